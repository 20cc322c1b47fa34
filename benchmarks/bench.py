"""`make bench`: runs all benchmarks on one machine, side by side with a bare echo server.

`make bench ARGS=core` runs one part. The exit code is 1 if a goal of
simulated time, CPU time or a ratio is missed; missed goals of wall time and of p99 are only reported. With
`--gate`, as `make nightly` asks, a goal may be missed by a margin, and a part that misses one is measured
again, at most twice: the cost of our code shows in each run, other load does not.
"""

import argparse
import sys

from benchmarks import carrying, core, corners, dense_paths, floods, replies, start
from benchmarks.figures import Figure, table

PARTS = {
    "replies": replies.measure,
    "core": core.measure,
    "carrying": carrying.measure,
    "start": start.measure,
    "corners": corners.measure,
    "dense": dense_paths.measure,
    "floods": floods.measure,
}
GATE_RUNS = 3


def main() -> int:
    """Measure, and print a table and JSON."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all without one")
    parser.add_argument("--gate", action="store_true", help="with margins for a busy machine")
    options = parser.parse_args()
    if unknown := [part for part in options.parts if part not in PARTS]:
        parser.error(f"no such part: {', '.join(unknown)}; there are {', '.join(PARTS)}")
    figures: list[Figure] = []
    missed: list[str] = []
    for name in options.parts or PARTS:
        print(f"measuring {name} ...", file=sys.stderr)
        found = PARTS[name]()
        figures += found
        failing = {each.name: each.goal for each in found if not each.held(options.gate)}
        for _ in range(GATE_RUNS - 1 if options.gate else 0):
            if failing:
                held = {each.name for each in PARTS[name]() if each.held(True)}
                failing = {figure: goal for figure, goal in failing.items() if figure not in held}
        missed += [f"{figure}: {goal}" for figure, goal in failing.items()]
    print(table(figures))
    for line in missed:
        print(f"missed: {line}", file=sys.stderr)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
