"""Reads the motion in a recording."""

import tempfile
from pathlib import Path

import numpy as np

from iiwa_sim.plot.motion import History, Motion
from iiwa_sim.plot.script import PlotFault
from iiwa_sim.protocols.dialogue import Direction
from iiwa_sim.recordings.read import Recorded, Spoken
from iiwa_sim.recordings.watch import Event
from iiwa_sim.robot.description import SETTINGS_FILE, URDF_FILE, RobotDescription, load_robot

MOST_SAMPLES = 60_000
"""Most samples of a picture, two minutes at 500 Hz; a longer recording is thinned out."""


def motion_in(recorded: Recorded) -> Motion:
    """Read the motion in a recording.

    Raises PlotFault where there is nothing to draw, RecordingFault and RobotFault.
    """
    rows: list[tuple[float, ...]] = []
    for state in recorded.states():
        time_s = state.tick / recorded.head.tick_rate_hz
        if not rows or time_s > rows[-1][0]:
            places = (*state.tool_frame[:3], *state.cartesian_force[:3])
            rows.append((time_s, *state.joint_position, *state.joint_velocity, *places))
    if len(rows) < 2:
        raise PlotFault(f"{recorded.path}: expected two states at least, to draw a picture of")
    values = np.array(rows[:: -(-len(rows) // MOST_SAMPLES)])
    start_s, count = rows[0][0], len(recorded.head.joints)
    history = History()
    for each in recorded.said_and_happened():
        if isinstance(each, Spoken):
            history.say(each.text if each.direction == Direction.FROM_CLIENT.value else "")
        else:
            event = Event(each.kind, each.text, each.move, each.code, each.goal_frame)
            history.happen(each.tick / recorded.head.tick_rate_hz - start_s, event)
    return Motion(
        path=str(recorded.path),
        description=_description(recorded),
        times_s=values[:, 0] - start_s,
        joints=values[:, 1 : 1 + count],
        velocity=values[:, 1 + count : 1 + 2 * count],
        tcp_mm=values[:, 1 + 2 * count : 4 + 2 * count],
        force_n=values[:, 4 + 2 * count :],
        moves=history.moves,
        faults=history.faults,
    )


def _description(recorded: Recorded) -> RobotDescription:
    """Load the robot whose files are in the recording."""
    with tempfile.TemporaryDirectory() as folder:
        for name in (SETTINGS_FILE, URDF_FILE):
            content = recorded.head.attachments.get(name)
            if content is None:
                raise PlotFault(f"{recorded.path}: there is no {name} in it, by which to draw the robot")
            Path(folder, name).write_bytes(content)
        return load_robot(folder)
