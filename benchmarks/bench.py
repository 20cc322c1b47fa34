"""`make bench`: measure speed on this machine, and compare it with goals.

`make bench ARGS=core` runs one part. The exit code is 1 if a goal with a margin is missed. Other goals, of
wall time, are only reported: other load decides them. With `--gate`, as `make nightly` asks, a goal may be
missed by its margin, and a part that misses one is measured again, at most twice.
"""

import argparse
import sys

from benchmarks import carrying, core, floods, replies, start
from benchmarks.figure import Figure

PARTS = {
    "replies": replies.measure,
    "core": core.measure,
    "carrying": carrying.measure,
    "start": start.measure,
    "floods": floods.measure,
}
RUNS_AGAIN = 2


def main() -> int:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all without one")
    parser.add_argument("--gate", action="store_true", help="with margins for a busy machine")
    options = parser.parse_args()
    if unknown := [part for part in options.parts if part not in PARTS]:
        parser.error(f"no such part: {', '.join(unknown)}; there are {', '.join(PARTS)}")
    figures: list[Figure] = []
    missed: set[str] = set()
    for part in options.parts or PARTS:
        print(f"measuring {part} ...", file=sys.stderr)
        found = PARTS[part]()
        figures += found
        failing = failures(found, options.gate)
        for _ in range(RUNS_AGAIN if options.gate else 0):
            if failing:
                failing &= failures(PARTS[part](), True)
        missed |= failing
    print(table(figures))
    for name in sorted(missed):
        print(f"missed: {name}", file=sys.stderr)
    return 1 if missed else 0


def failures(figures: list[Figure], gate: bool) -> set[str]:
    """Return the names of the figures that make a run fail."""
    strict = [each for each in figures if each.margin is not None]
    return {each.name for each in strict if not each.meets(each.margin or 1.0 if gate else 1.0)}


def table(figures: list[Figure]) -> str:
    """Return one line per figure."""
    rows = [("", "value", "unit", "echo", "ratio", "goal", "met")]
    for each in figures:
        echo = ("", "") if each.echo is None else (short(each.echo), f"{each.compared:.2f}")
        met = "" if not each.goal else "yes" if each.meets() else "NO"
        rows.append((each.name, short(each.value), each.unit, *echo, each.goal, met))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    layout = "  ".join(f"{{:{side}{width}}}" for side, width in zip("<><>><<", widths, strict=True))
    return "\n".join(layout.format(*row).rstrip() for row in rows)


def short(value: float) -> str:
    """Return a value in three digits, or as a whole number."""
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


if __name__ == "__main__":
    sys.exit(main())
