"""Tries a property of the tests at more seeds than they do.

`python -m tools.hunt tests.contact.test_energy:contact 0 10000` calls that function with each seed. It
asserts, and gives figures: told are the seeds at which it fails, and in the end the largest of each figure.
"""

from __future__ import annotations

import argparse
from importlib import import_module


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tools.hunt", description="a property at many seeds")
    parser.add_argument("function", help="of a seed, as tests.handling.test_energy:grip")
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    asked = parser.parse_args()
    module, _, name = asked.function.partition(":")
    function = getattr(import_module(module), name)
    largest: dict[str, tuple[float, int]] = {}
    for seed in range(asked.first, asked.first + asked.count):
        try:
            figures = function(seed)
        except AssertionError as fault:
            print(f"{seed}: {fault or 'does not hold'}", flush=True)
            continue
        for each, value in figures.items():
            largest[each] = max(largest.get(each, (value, seed)), (value, seed))
    for each, (value, seed) in largest.items():
        print(f"{each}: {value:.5g} at most, of seed {seed}")


if __name__ == "__main__":
    main()
