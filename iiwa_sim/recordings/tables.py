"""A recording as tables: states, parts, dialogue and events, as CSV."""

import csv
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path

from iiwa_sim.controller.handling import PartState
from iiwa_sim.controller.state import RobotStatus, Snapshot
from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.read import Happened, Recorded, Spoken
from iiwa_sim.recordings.schemas import DIALOGUE, EVENTS, STATE

_FRAME = ("x_mm", "y_mm", "z_mm", "alpha_rad", "beta_rad", "gamma_rad")
_WRENCH = ("force_x_n", "force_y_n", "force_z_n", "torque_x_nm", "torque_y_nm", "torque_z_nm")
_JOINTS = {
    "joint_position": "rad",
    "joint_velocity": "rad_per_s",
    "joint_torque": "nm",
    "goal_joint_position": "rad",
}
_FRAMES = ("flange", "tool", "goal")
_LOAD = ("mass_kg", "x_mm", "y_mm", "z_mm")
_PART = ("time_s", "tick", "name", "state", *_FRAME)

Row = Sequence[object]


def write_tables(recorded: Recorded, folder: Path) -> list[Path]:
    """Write a file each for states, dialogue, events and parts, named after the recording; gives their paths.

    The columns carry their units. Parts have a row at the beginning, and one for each state in which they are
    elsewhere; a recording without parts has no file of them. Files that are there are overwritten. Raises
    RecordingFault.
    """
    joints = recorded.joints
    tables: dict[str, tuple[Row, Iterator[Row]]] = {
        "state": (_state_columns(joints), map(_state_row, recorded.contents(STATE))),
        "dialogue": (Spoken.__struct_fields__, map(_fields, recorded.contents(DIALOGUE))),
        "events": (Happened.__struct_fields__, map(_fields, recorded.contents(EVENTS))),
    }
    if any(state.parts for state in islice(recorded.contents(STATE), 1)):
        tables["parts"] = (_PART, _part_rows(recorded.contents(STATE)))
    written = []
    for name, (columns, rows) in tables.items():
        path = folder / f"{recorded.path.stem}.{name}.csv"
        try:
            _write(path, columns, rows)
        except OSError as fault:
            raise RecordingFault(f"{path}: cannot be written: {fault.strerror}") from None
        written.append(path)
    return written


def _write(path: Path, columns: Row, rows: Iterable[Row]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def _state_columns(joints: Sequence[str]) -> list[str]:
    return [
        "time_s",
        "tick",
        "mode",
        "status",
        *(f"{name}_{joint}_{unit}" for name, unit in _JOINTS.items() for joint in joints),
        *(f"{name}_{part}" for name in _FRAMES for part in _FRAME),
        *_WRENCH,
        "override",
        *(f"robot_status_{name}" for name in RobotStatus._fields),
        *(f"tool_load_{name}" for name in _LOAD),
        "gripper_opening_mm",
        "gripper_state",
        "link_touches",
        "inputs",
        "outputs",
        "error_code",
        "error_reason",
    ]


def _state_row(state: Snapshot) -> list[object]:
    return [
        state.time_s,
        state.tick,
        state.mode,
        state.status,
        *(value for name in _JOINTS for value in getattr(state, name)),
        *(value for name in _FRAMES for value in getattr(state, f"{name}_frame")),
        *state.cartesian_force,
        state.override,
        *state.robot_status,
        *state.tool_load,
        "" if state.gripper is None else state.gripper.opening_mm,
        "" if state.gripper is None else state.gripper.state,
        "; ".join(f"{touch.link} {touch.surface}" for touch in state.link_touches),
        _bits(state.inputs),
        _bits(state.outputs),
        state.error.code,
        state.error.reason,
    ]


def _part_rows(states: Iterable[Snapshot]) -> Iterator[list[object]]:
    before: dict[str, PartState] = {}
    for state in states:
        for part in state.parts:
            if before.get(part.name) != part:
                before[part.name] = part
                yield [state.time_s, state.tick, part.name, part.state, *part.frame]


def _bits(states: Sequence[bool]) -> str:
    """`0 1 0`, from number 1 on."""
    return " ".join(str(int(state)) for state in states)


def _fields(found: Spoken | Happened) -> list[object]:
    values = [getattr(found, name) for name in found.__struct_fields__]
    return [" ".join(map(str, value)) if isinstance(value, tuple) else value for value in values]
