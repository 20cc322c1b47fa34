"""`make bench`: all measured in one run on one machine, beside a bare echo server.

`make bench ARGS="core --json FILE"` measures one part only and writes the JSON to a file.
"""

import argparse
import sys
from pathlib import Path

from benchmarks import chains, core, dense_paths, durations, fleet, moves, replies, servo, start, status
from benchmarks.figures import Figure, as_json, table

PARTS = {
    "replies": replies.measure,
    "moves": moves.measure,
    "core": core.measure,
    "start": start.measure,
    "durations": durations.measure,
    "chains": chains.measure,
    "dense": dense_paths.measure,
    "servo": servo.measure,
    "status": status.measure,
    "fleet": fleet.measure,
}


def main() -> None:
    """Measure, and print a table and JSON."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all without one")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the JSON there, not to the screen")
    options = parser.parse_args()
    unknown = [part for part in options.parts if part not in PARTS]
    if unknown:
        parser.error(f"no such part: {', '.join(unknown)}; there are {', '.join(PARTS)}")

    figures: list[Figure] = []
    for part in options.parts or PARTS:
        print(f"measuring {part} ...", file=sys.stderr)
        figures += PARTS[part]()
    print(table(figures))
    if options.json is None:
        print(as_json(figures))
    else:
        options.json.write_text(as_json(figures) + "\n")


if __name__ == "__main__":
    main()
