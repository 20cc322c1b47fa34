"""What all panels have in common: colours, and the numbers of the targets."""

from collections.abc import Sequence
from math import dist

from iiwa_sim.plot.record import Recording

# Okabe and Ito's colours, which colour-blind readers can tell apart; without yellow, too pale on white.
COLOURS = ("#000000", "#e69f00", "#56b4e9", "#009e73", "#0072b2", "#d55e00", "#cc79a7")
MOST_NUMBERS = 40
"""More targets than these are drawn without numbers, which would only cover each other."""
_MOST_AT_ONE_PLACE = 4

Place = tuple[float, ...]


def numbers(recording: Recording) -> list[str]:
    """The number of each target, from 1; empty for those of a stream, and for all where they are too many."""
    found: list[str] = []
    count = 0
    for target in recording.targets:
        count += not target.servo
        found.append("" if target.servo else str(count))
    return found if count <= MOST_NUMBERS else [""] * len(found)


def together(numbered: Sequence[tuple[Place, str]], closest: float) -> list[tuple[Place, str]]:
    """One label, at the first of them, for the numbers of places closer to it than `closest`."""
    groups: list[tuple[Place, list[str]]] = []
    for place, number in numbered:
        for first, others in groups:
            if dist(first, place) < closest:
                others.append(number)
                break
        else:
            groups.append((place, [number]))
    return [(place, _listed(each)) for place, each in groups]


def _listed(names: list[str]) -> str:
    if len(names) > _MOST_AT_ONE_PLACE:
        names = [*names[: _MOST_AT_ONE_PLACE - 1], "...", names[-1]]
    return ", ".join(names)
