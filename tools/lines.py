"""Compare lines per part of the repository with the budgets in pyproject.toml; fail where one is exceeded."""

import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

PACKAGE = "iiwa_sim"


def part_of(path: Path) -> str | None:
    """Return the key of the budget that counts a file: a package, a folder, or `docs` for all pages."""
    if path.suffix == ".md":
        return "docs"
    if path.suffix not in (".py", ".pxd") and path.parts[0] not in (".ci", "examples"):
        return None
    if path.parts[0] == PACKAGE and path.stem.endswith("_kernel"):
        return "compiled"
    folders = path.parent.parts
    return "/".join(folders[: 2 if folders[:1] == (PACKAGE,) else 1]) or "."


def main() -> int:
    budgets = tomllib.loads(Path("pyproject.toml").read_text())["tool"]["iiwa-sim"]["lines"]
    listed = subprocess.run(["git", "ls-files"], capture_output=True, text=True, check=True).stdout
    lines: Counter[str] = Counter()
    for path in map(Path, listed.splitlines()):
        if path.exists() and (part := part_of(path)):
            lines[part] += path.read_bytes().count(b"\n")
    for part in sorted({*lines, *budgets}):
        over = lines[part] > budgets.get(part, 0)
        print(f"{part:24} {lines[part]:6} of {budgets.get(part, 0):6}{'  EXCEEDED' if over else ''}")
    return int(any(lines[part] > budgets.get(part, 0) for part in lines))


if __name__ == "__main__":
    sys.exit(main())
