"""Links of pages: what they name is there, and they lead in the site where they lead in the repository."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.pages.links import page_of, rewritten, root_pages, sources, targets

ROOT = Path(__file__).parent.parent.parent
PAGES = [*root_pages(), *(str(page.relative_to(ROOT)) for page in sorted((ROOT / "docs").rglob("*.md")))]


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_links_to_is_there(page: str) -> None:
    assert [path for path in targets((ROOT / page).read_text(), page) if not (ROOT / path).exists()] == []


@pytest.mark.parametrize(
    ("origin", "link", "there"),
    [
        ("docs/cell.md", "backdoor.md#time", "backdoor.md#time"),
        ("docs/cell.md", "../README.md#docker", "index.md#docker"),
        ("docs/cell.md", "../examples/table.toml", "source/examples/table.toml/index.md"),
        ("docs/cell.md", "../protocol/errors.toml", "reference/errors.md"),
        ("README.md", "docs/cell.md", "cell.md"),
        ("README.md", "SECURITY.md", "project/security.md"),
        ("CONTRIBUTING.md", "docs/motion.md", "../motion.md"),
        ("CONTRIBUTING.md", "README.md", "../index.md"),
        ("docs/cell.md", "https://example.org/a", "https://example.org/a"),
        ("docs/cell.md", "#noise", "#noise"),
    ],
)
def test_a_link_leads_to_the_page_of_what_it_names(origin: str, link: str, there: str) -> None:
    assert rewritten(f"see [this]({link})", origin) == f"see [this]({there})"


def test_files_and_folders_that_are_linked_to_have_pages() -> None:
    pages = sources({"docs/cell.md": "[a](../examples/table.toml) [b](../examples/cpp) [c](backdoor.md)"})
    assert set(pages) == {page_of("examples/table.toml"), page_of("examples/cpp")}
    assert "```toml\n" in pages[page_of("examples/table.toml")]
    assert "## CMakeLists.txt" in pages[page_of("examples/cpp")]


def test_a_link_to_nothing_is_told_with_its_page() -> None:
    with pytest.raises(FileNotFoundError, match=r"docs/cell\.md: a link to examples/none\.toml"):
        sources({"docs/cell.md": "[a](../examples/none.toml)"})
