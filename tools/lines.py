"""Compare lines per part of the repository with the budgets in pyproject.toml; fail where one is exceeded.

Also fail for a docstring in iiwa_sim that begins with a clause, such as "What ..." or "Whether ...".
"""

import ast
import re
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

PACKAGE = "iiwa_sim"
CLAUSE = re.compile(r"(What|Whether|Where|Who|Of|As|So|That|None|All)\b")


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


def clauses(path: Path) -> list[str]:
    """Return the docstrings of a file, those of attributes included, that begin with a clause."""
    nodes = [each.value for each in ast.walk(ast.parse(path.read_bytes())) if isinstance(each, ast.Expr)]
    texts = [each.value for each in nodes if isinstance(each, ast.Constant)]
    return [text.splitlines()[0] for text in texts if isinstance(text, str) and CLAUSE.match(text)]


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
    wrong = [f"{path}: {text}" for path in Path(PACKAGE).rglob("*.py") for text in clauses(path)]
    print(*wrong, sep="\n", end="\n" * bool(wrong))
    return int(bool(wrong) or any(lines[part] > budgets.get(part, 0) for part in lines))


if __name__ == "__main__":
    sys.exit(main())
