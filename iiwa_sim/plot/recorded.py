"""A recording in MCAP, as what is drawn."""

import tempfile
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from iiwa_sim.backdoor.described import DescribedCapsule, surface_from
from iiwa_sim.contact.surface import Surface
from iiwa_sim.dialect.wire.dialogue import Direction
from iiwa_sim.handling.gripper import JAW_M
from iiwa_sim.plot.fault import PlotFault
from iiwa_sim.plot.names import Named, named_in
from iiwa_sim.plot.record import Array, Fault, Recording, Target
from iiwa_sim.plot.script import Script
from iiwa_sim.plot.things import Things, ThingsOverTime, shapes_of
from iiwa_sim.recordings import watch
from iiwa_sim.recordings.read import Recorded, Spoken
from iiwa_sim.recordings.schemas import CELL
from iiwa_sim.robot.description import SETTINGS_FILE, URDF_FILE, RobotDescription, load_robot

MOST_SAMPLES = 60_000
"""Most samples of a picture, two minutes at 500 Hz; a longer recording has fewer drawn for each second."""


def drawn_from(recorded: Recorded) -> Recording:
    """The joints, the TCP and the forces at even times, with the moves that began and how they ended.

    Where states are missing, straight lines are drawn. Thresholds of force moves are not in a recording.
    Raises PlotFault where there is nothing to draw, RecordingFault and RobotFault.
    """
    ticks: list[int] = []
    rows: list[tuple[float, ...]] = []
    seen: list[Things] = []
    for state in recorded.states():
        if ticks and state.tick <= ticks[-1]:
            continue
        ticks.append(state.tick)
        rows.append((*state.joint_position, *state.tool_frame, *state.cartesian_force[:3]))
        seen.append(Things(state.tick, state.gripper, state.parts, state.link_touches))
    if len(ticks) < 2:
        raise PlotFault(f"{recorded.path}: expected two states at least, to draw a picture of")
    found = np.array(ticks)
    step = max(int(np.diff(found).min()), -(-int(found[-1] - found[0]) // MOST_SAMPLES))
    wanted = np.arange(found[0], found[-1] + step, step)
    values = np.array(rows)
    even: Array = np.column_stack([np.interp(wanted, found, column) for column in values.T])
    count = len(recorded.head.joints)
    surfaces, things = _cell(recorded)
    for each in seen:
        things.add(each._replace(tick=-(-(each.tick - ticks[0]) // step)))
    # An angle that passes half a turn would be drawn through zero between two states.
    turns = values[np.searchsorted(found, wanted).clip(max=len(found) - 1), count + 3 : count + 6]
    return Recording(
        script=Script(str(recorded.path), ()),
        description=_description(recorded),
        tick_s=step / recorded.head.tick_rate_hz,
        joints=even[:, :count],
        tcp_mm=even[:, count : count + 3],
        tcp_turn=turns,
        force_n=even[:, count + 6 :],
        targets=_targets(recorded, int(found[0]), step, len(wanted)),
        watches=(),
        things=things,
        surfaces=surfaces,
        faults=_faults(recorded, int(found[0]), step, len(wanted)),
    )


def _targets(recorded: Recorded, first: int, step: int, count: int) -> tuple[Target, ...]:
    begun: dict[int, Target] = {}
    known = _named(recorded)
    for event in recorded.events():
        if event.kind == watch.BEGINS and len(event.goal_frame) == 6:
            x, y, z = event.goal_frame[:3]
            name, blending_mm = known.get(event.move, Named())
            begun[event.move] = Target(0, (x, y, z), blending_mm, event.text, name=name)
        elif event.kind == watch.ENDS and event.code == 0 and event.move in begun:
            place = _place(event.tick, first, step, count)
            begun[event.move] = replace(begun[event.move], done_tick=place)
    return tuple(begun.values())


def _faults(recorded: Recorded, first: int, step: int, count: int) -> tuple[Fault, ...]:
    faults = [event for event in recorded.events() if event.kind == watch.FAULT]
    return tuple(Fault(_place(event.tick, first, step, count), event.code) for event in faults)


def _place(tick: int, first: int, step: int, count: int) -> int:
    """The number, among the samples, of the one nearest to a tick."""
    return min(max(round((tick - first) / step), 0), count - 1)


def _named(recorded: Recorded) -> dict[int, Named]:
    """What lines say of the moves they ask for, by the moves' numbers.

    A move is accepted between a line and its reply; one that no line asks for, as over ROS, has no name.
    """
    found: dict[int, Named] = {}
    line = ""
    for each in recorded.said_and_happened():
        if isinstance(each, Spoken):
            line = each.text if each.direction == Direction.FROM_CLIENT.value else ""
        elif line and each.kind == watch.ACCEPTED:
            found[each.move] = named_in(line)
    return found


def _cell(recorded: Recorded) -> tuple[tuple[Surface, ...], ThingsOverTime]:
    """Surfaces as they stood when the recording began, and what its parts, jaws and tool look like."""
    for message in recorded.messages((CELL,)):
        try:
            told = msgspec.json.decode(message.data, type=_Cell)
            x, y, z = (1e-3 * each for each in told.jaw_mm) if len(told.jaw_mm) == 3 else JAW_M
            tool = tuple(each.capsule() for each in told.tool_capsules)
            surfaces = tuple(map(surface_from, told.surfaces))
            return surfaces, ThingsOverTime(shapes_of(told.parts), (x, y, z), tool)
        except ValueError as fault:  # as all errors of msgspec are
            what = "expected surfaces and parts as iiwa-sim writes them"
            raise PlotFault(f"{recorded.path}: {CELL}: {what}: {fault}") from None
    return (), ThingsOverTime()


class _Cell(msgspec.Struct):
    surfaces: list[dict[str, object]]
    parts: list[dict[str, object]] = []
    jaw_mm: list[float] = []
    tool_capsules: list[DescribedCapsule] = []


def _description(recorded: Recorded) -> RobotDescription:
    """The description of the robot whose files are in the recording."""
    with tempfile.TemporaryDirectory() as folder:
        for name in (SETTINGS_FILE, URDF_FILE):
            content = recorded.head.attachments.get(name)
            if content is None:
                raise PlotFault(f"{recorded.path}: there is no {name} in it, by which to draw the robot")
            Path(folder, name).write_bytes(content)
        return load_robot(folder)
