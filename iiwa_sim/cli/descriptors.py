"""The limit of open files and sockets."""

import contextlib
import resource

from iiwa_sim.wording import Unusable

SPARE = 64
"""Descriptors for clients, libraries and short use during the start."""


def allow_descriptors(robots: int, needed: int) -> None:
    """Raise the limit of open descriptors, whose default of 1,024 is too low for 500 robots.

    Raises Unusable if the robots need more than the system allows.
    """
    few, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    with contextlib.suppress(OSError, ValueError):  # a system with another limit besides
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
        few = most
    if few != resource.RLIM_INFINITY and needed + SPARE > few:
        raise Unusable(f"{robots} robots need {needed + SPARE} open files: expected up to {few} (ulimit -Hn)")
