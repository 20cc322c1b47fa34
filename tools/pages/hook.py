"""What mkdocs calls while it builds the site: pages are written from tables and dialogues, links made to fit.

`mkdocs.yml` names it, and `make docs` builds; strict, so that a link to nothing fails.
"""

from __future__ import annotations

import logging
import re
import subprocess
import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from tools.pages import commands, links, tables

logging.getLogger("iiwa_sim").setLevel(logging.ERROR)  # what the transcripts have refused is no news

REQUIREMENTS = "docs/requirements.md"
ELSEWHERE = re.compile(r"""<(?:script|link|img|iframe)\b[^>]*\b(?:src|href)=["']?(?:https?:)?//""")

_origins: dict[str, str] = {}
"""Pages that are files of the repository, by their path in the site; others are written for the site."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages that are in no file of docs/."""
    texts = {f"docs/{each.src_uri}": each.content_string for each in files.documentation_pages()}
    texts |= {name: (links.ROOT / name).read_text(encoding="utf-8") for name in links.root_pages()}
    texts[REQUIREMENTS] = _requirements()
    _origins.update({links.page_of(origin): origin for origin in texts})
    written = {page.path: page.text for page in (*commands.pages(), *tables.pages())}
    try:
        written |= links.sources(texts)
    except FileNotFoundError as fault:
        raise PluginError(str(fault)) from None
    written |= {
        links.page_of(name): text
        for name, text in texts.items()
        if files.get_file_from_path(links.page_of(name)) is None
    }
    for path, text in written.items():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, **_: object) -> str:
    """Makes the links fit."""
    origin = _origins.get(page.file.src_uri)
    return markdown if origin is None else links.rewritten(markdown, origin)


def on_post_build(config: MkDocsConfig) -> None:
    """Fails where a page has a browser fetch something from elsewhere."""
    for page in Path(config.site_dir).rglob("*.html"):
        found = ELSEWHERE.search(page.read_text(encoding="utf-8"))
        if found:
            raise PluginError(f"{page}: {found[0]}: expected nothing to be fetched from elsewhere")


def _requirements() -> str:
    command = [sys.executable, "-m", "tools.requirements", "--page"]
    done = subprocess.run(command, cwd=links.ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        raise PluginError(f"{' '.join(command)}: {done.stdout}{done.stderr}")
    return done.stdout
