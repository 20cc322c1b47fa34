"""Colours, and numbers and names of moves, for all panels."""

from collections.abc import Sequence
from math import dist

from iiwa_sim.plot.record import Recording

# Colours of Okabe and Ito, which colour-blind readers can tell apart; without yellow, which is too pale on
# white.
COLOURS = ("#000000", "#e69f00", "#56b4e9", "#009e73", "#0072b2", "#d55e00", "#cc79a7")
SURFACE, SURFACE_ALPHA = "#7a8f88", 0.25
"""Colour and opacity of surfaces."""
PART, JAW, TOOL, TOUCH, FORCE = "#c8862b", "#46484e", "#70737a", "#c92a2a", "#e8590c"
"""Colours of parts, jaws, the tool, places where links touch surfaces, and the force at the TCP."""
FAULT = "#c92a2a"
"""Colour of the beginning of the error state."""
MOST_NUMBERS = 40
"""Most targets that are drawn with numbers: those of more would cover each other."""
_MOST_AT_ONE_PLACE = 4

Place = tuple[float, ...]


def numbers(recording: Recording) -> list[str]:
    """The number of each target, from 1; empty for targets of a servo stream, and for all if there are too
    many."""
    found: list[str] = []
    count = 0
    for target in recording.targets:
        count += not target.servo
        found.append("" if target.servo else str(count))
    return found if count <= MOST_NUMBERS else [""] * len(found)


def names(recording: Recording) -> list[str]:
    """The number and the name of each target that has a number, as `1 LIN 0.5 r30`."""
    return [
        f"{number} {target.name}".rstrip()
        for target, number in zip(recording.targets, numbers(recording), strict=True)
        if number
    ]


def together(numbered: Sequence[tuple[Place, str]], closest: float) -> list[tuple[Place, str]]:
    """Merge the numbers of places closer than `closest` into one label at the first of them."""
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
