"""How many files and sockets the process may have open."""

import contextlib
import resource

from iiwa_sim.wording import Unusable

SPARE = 64
"""For clients, libraries and what a start opens for a moment."""


def allow_descriptors(robots: int, needed: int) -> None:
    """Have the system let the process open more: 1,024, with which it begins, are too few for 500 robots.

    Raises Unusable where so many robots need more than it lets it have.
    """
    few, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    with contextlib.suppress(OSError, ValueError):  # of a system that has another limit besides
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
        few = most
    if few != resource.RLIM_INFINITY and needed + SPARE > few:
        raise Unusable(f"{robots} robots need {needed + SPARE} open files: expected up to {few} (ulimit -Hn)")
