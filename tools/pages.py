"""Hook of mkdocs: adds pages of KRC4 messages and Python, and the pages at the repository's root.

Links are written as they hold in the repository; those to files outside of docs/ become plain text in the
site.
"""

from __future__ import annotations

import re
from pathlib import Path
from posixpath import dirname, join, normpath, relpath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

import iiwa_sim
from iiwa_sim.protocols.krc4_xml import MESSAGES

ROOT = Path(__file__).parents[1]
PAGES = {  # of files outside of docs/
    "README.md": "index.md",
    "CHANGELOG.md": "project/changelog.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "protocol/krc4.toml": "reference/messages.md",
}
LINK = re.compile(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]\((?!https?:|#|mailto:)([^)\s#]+)(#[^)\s]*)?\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are in no file of docs/."""
    written = {page: (ROOT / name).read_text("utf-8") for name, page in PAGES.items() if name.endswith(".md")}
    written |= {"reference/messages.md": _messages(), "reference/python.md": _python()}
    for path, text in written.items():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Rewrite the links. Raises FileNotFoundError for a link to nothing."""
    path = page.file.src_uri
    if path.startswith("reference/"):
        return markdown
    origin = {site: name for name, site in PAGES.items()}.get(path, f"docs/{path}")

    def link(found: re.Match[str]) -> str:
        target = normpath(join(dirname(origin), found[2]))
        if not (ROOT / target).exists():
            raise FileNotFoundError(f"{origin}: a link to {target}, which is not there")
        inside = PAGES.get(target) or (target.removeprefix("docs/") if target.startswith("docs/") else "")
        return (
            f"[{found[1]}]({relpath(inside, dirname(path) or '.')}{found[3] or ''})" if inside else found[1]
        )

    return LINK.sub(link, markdown)


def _messages() -> str:
    text = "# KRC4 messages\n"
    for tag, each in MESSAGES.items():
        rows = [(*row, "request") for row in each.get("inputs", {}).items()] + [
            (*row, "reply") for row in each.get("outputs", {}).items()
        ]
        if "joints" in each:
            direction = "request" if each["joints"] == "input" else "reply"
            rows.append(("R0 ...", "joint positions of all axes, deg", direction))
        table = [f"| `{register}` | {direction} | {meaning} |" for register, meaning, direction in rows]
        text += f"\n## {tag}\n\n{each['summary']} In `I1` it is {each['id']}.\n\n"
        text += "\n".join(["| | in the | |", "|---|---|---|", *table, ""]) if table else ""
    return text


def _python() -> str:
    """Return directives of mkdocstrings for all that `iiwa_sim` exports."""
    text = "# Python\n\nImport these names from `iiwa_sim`.\n"
    names = sorted(iiwa_sim.__all__, key=lambda name: (iiwa_sim._HOME_OF[name], name))
    return text + "".join(f"\n::: {iiwa_sim._HOME_OF[name]}.{name}\n" for name in names)
