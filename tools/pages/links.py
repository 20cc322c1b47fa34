"""Links of pages, which are written to be read in the repository, as they have to be in the site.

What a page links to outside of docs/ has a page of its own there: a file's text, or a folder's files.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from posixpath import dirname, join, normpath, relpath

ROOT = Path(__file__).parent.parent.parent
DOCS = "docs"
HOME, HOME_PAGE = "README.md", "index.md"
TABLES = {
    "protocol/iiwa.toml": "reference/commands/index.md",
    "protocol/krc4.toml": "reference/messages/index.md",
    "protocol/backdoor.toml": "reference/bench/index.md",
    "protocol/errors.toml": "reference/errors.md",
    "iiwa_sim/cli/server_options.py": "reference/options.md",
}
"""What has a page that is written from it."""
_LINK = re.compile(r"\]\((?!https?:|#|mailto:)([^)\s#]+)(#[^)\s]*)?\)")
_LANGUAGES = {".py": "python", ".toml": "toml", ".yaml": "yaml", ".yml": "yaml", ".cpp": "cpp", ".hpp": "cpp"}
_LANGUAGES |= {".mjs": "javascript", ".json": "json", ".ini": "ini"}
_TEXTS = {*_LANGUAGES, ".txt", ".md", ".cmake", ""}


def page_of(path: str) -> str:
    """Where in the site a file or folder of the repository is; the path is from the repository's root."""
    if path == HOME:
        return HOME_PAGE
    if path in TABLES:
        return TABLES[path]
    if path.startswith(f"{DOCS}/"):
        return path.removeprefix(f"{DOCS}/")
    if "/" not in path and path.endswith(".md"):
        return f"project/{path.lower()}"
    return f"source/{path}/index.md"


def targets(text: str, origin: str) -> set[str]:
    """The paths, from the repository's root, to which a text links that lies at `origin` there."""
    return {_resolved(found[1], origin) for found in _LINK.finditer(text)}


def rewritten(text: str, origin: str) -> str:
    """The text of the file `origin`, its links going from its page in the site to those of what it names."""
    place = dirname(page_of(origin))

    def link(found: re.Match[str]) -> str:
        return f"]({relpath(page_of(_resolved(found[1], origin)), place or '.')}{found[2] or ''})"

    return _LINK.sub(link, text)


def sources(texts: Mapping[str, str]) -> dict[str, str]:
    """Pages, by their path in the site, of all that texts link to and is no page yet.

    The texts are by their path in the repository. Raises FileNotFoundError for a link to nothing.
    """
    linked = set().union(*(targets(text, origin) for origin, text in texts.items()))
    wanted = {path for path in linked if page_of(path).startswith("source/")}
    for path in sorted(wanted):
        if not (ROOT / path).exists():
            origins = [origin for origin, text in texts.items() if path in targets(text, origin)]
            raise FileNotFoundError(f"{', '.join(origins)}: a link to {path}, which is not there")
    return {page_of(path): _source(path) for path in wanted}


def _resolved(target: str, origin: str) -> str:
    return normpath(join(dirname(origin), target))


def _source(path: str) -> str:
    place = ROOT / path
    if place.is_file():
        return f"# {path}\n\n{_shown(place)}"
    files = sorted(each for each in place.rglob("*") if each.is_file() and "__pycache__" not in each.parts)
    parts = [f"## {each.relative_to(place)}\n\n{_shown(each)}" for each in files]
    return "\n\n".join([f"# {path}", *parts])


def _shown(file: Path) -> str:
    if file.suffix not in _TEXTS:
        return f"{file.stat().st_size} bytes that are no text."
    text = file.read_text(encoding="utf-8")
    fence = "````" if "```" in text else "```"
    return f"{fence}{_LANGUAGES.get(file.suffix, 'text')}\n{text.rstrip()}\n{fence}\n"


def root_pages() -> Iterable[str]:
    """The pages at the repository's root."""
    return sorted(path.name for path in ROOT.glob("*.md"))
