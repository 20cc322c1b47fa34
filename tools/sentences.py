"""Check README, CONTRIBUTING and docs: sentences of at most 35 words, with a mean of 16 on each page.

Tables, code, headings and the generated page of options do not count.
"""

import re
import sys
from pathlib import Path

MEAN, MOST = 16.0, 35


def sentences(page: Path) -> list[str]:
    """Return the sentences of a page as plain text."""
    text = re.sub(r"^```.*?^```|<!--.*?-->", "", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^(\||#|!\[|:::).*$", "\n", text, flags=re.MULTILINE)
    text = re.sub(r"`[^`]*`", "code", re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text))
    text = re.sub(r"^- \*\*[^*]*\*\*:", "- ", text, flags=re.MULTILINE)
    paragraphs = re.split(r"\n\s*\n|^\s*(?:[-*]|\d+\.) ", text, flags=re.MULTILINE)
    found = [each for paragraph in paragraphs for each in re.split(r"(?<=[.!?])[*)]*\s+", paragraph.strip())]
    return [each for each in found if len(each.split()) > 1]


def main() -> int:
    pages = {Path("README.md"), Path("CONTRIBUTING.md"), *Path("docs").glob("*.md")} - {
        Path("docs/options.md")
    }
    wrong: list[str] = []
    for page in sorted(pages):
        lengths = {text: len(text.split()) for text in sentences(page)}
        mean = sum(lengths.values()) / len(lengths)
        wrong += [f"{page}: {words} words: {text}" for text, words in lengths.items() if words > MOST]
        wrong += [f"{page}: a mean of {mean:.1f} words a sentence"] * (mean > MEAN)
    print("\n".join(wrong), end="\n" * bool(wrong))
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
