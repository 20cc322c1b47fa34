"""What the subcommands that take a recording have in common."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from iiwa_sim.recordings.fault import needs_mcap
from iiwa_sim.wording import harmless

if TYPE_CHECKING:
    from iiwa_sim.recordings.read import Recorded
    from iiwa_sim.recordings.timeline import Timeline

SUFFIX = ".mcap"


def is_recording(path: Path) -> bool:
    """Whether a file is to be taken for a recording: its name says so."""
    return path.suffix.lower() == SUFFIX


def opened(path: Path) -> "Recorded":
    """The recording of that name. Raises RecordingFault."""
    with needs_mcap():
        from iiwa_sim.recordings.read import Recorded
    return Recorded(path)


def tell_cut(recorded: "Recorded | Timeline") -> None:
    """Tell on stderr that a recording is cut off, and at what time; nothing for one that is whole."""
    if recorded.cut:
        at_s = recorded.cut_at_s
        where = "" if at_s is None else f" at {round(at_s, 3):g} s"
        told = f"iiwa-sim: {recorded.path}: cut off or damaged{where}: what follows is lost"
        print(harmless(told), file=sys.stderr)
