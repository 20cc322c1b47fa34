"""A recording as tables: states, parts, dialogue and events, as CSV."""

import csv
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec

from iiwa_sim.controller.state import RobotStatus, Snapshot
from iiwa_sim.recordings.read import Recorded
from iiwa_sim.recordings.recordings import RecordingFault
from iiwa_sim.recordings.schemas import DIALOGUE, EVENTS, STATE

_FRAME = ("x_mm", "y_mm", "z_mm", "alpha_rad", "beta_rad", "gamma_rad")
_COLUMNS = {
    "flange_frame": [f"flange_{key}" for key in _FRAME],
    "tool_frame": [f"tool_{key}" for key in _FRAME],
    "goal_frame": [f"goal_{key}" for key in _FRAME],
    "cartesian_force": ["force_x_n", "force_y_n", "force_z_n", "torque_x_nm", "torque_y_nm", "torque_z_nm"],
    "tool_load": [f"tool_load_{key}" for key in ("mass_kg", "x_mm", "y_mm", "z_mm")],
    "robot_status": [f"robot_status_{key}" for key in RobotStatus._fields],
    "gripper": ["gripper_opening_mm", "gripper_state"],
    "error": ["error_code", "error_reason"],
}
"""Columns of fields with several values."""
_OF_JOINTS = {
    "joint_position": "rad",
    "joint_velocity": "rad_per_s",
    "joint_torque": "nm",
    "goal_joint_position": "rad",
}
"""Units of fields with a value for each joint."""
Row = dict[str, Any]


def write_tables(recorded: Recorded, folder: Path) -> list[Path]:
    """Write a file each for states, dialogue, events and parts, named after the recording; return the paths.

    The columns carry their units. Parts have a row at the beginning, and one for each state in which they are
    elsewhere; a recording without parts has no file of them. Existing files are overwritten. Raises
    RecordingFault.
    """
    columns = _COLUMNS | {
        name: [f"{name}_{joint}_{unit}" for joint in recorded.joints] for name, unit in _OF_JOINTS.items()
    }
    tables: dict[str, Iterator[Row]] = {
        "state": (_row(state, columns) for state in recorded.contents(STATE)),
        "dialogue": (_row(each, {}) for each in recorded.contents(DIALOGUE)),
        "events": (_row(each, {}) for each in recorded.contents(EVENTS)),
        "parts": _part_rows(recorded.contents(STATE)),
    }
    written = []
    for name, rows in tables.items():
        path = folder / f"{recorded.path.stem}.{name}.csv"
        first = next(rows, {})
        if name == "parts" and not first:
            continue
        try:
            with path.open("w", encoding="utf-8", newline="") as file:
                writer = csv.DictWriter(file, list(first), lineterminator="\n")
                writer.writeheader()
                writer.writerows(chain([first], rows) if first else ())
        except OSError as fault:
            raise RecordingFault(f"{path}: cannot be written: {fault.strerror}") from None
        written.append(path)
    return written


def _row(content: msgspec.Struct, columns: dict[str, list[str]]) -> Row:
    """Return the fields of a content, some of them in several columns."""
    row = Row()
    for name, value in msgspec.structs.asdict(content).items():
        if name in columns:
            values = msgspec.structs.astuple(value) if isinstance(value, msgspec.Struct) else value
            row |= zip(columns[name], values or [""] * len(columns[name]), strict=True)
        elif name == "link_touches":
            row[name] = "; ".join(f"{each.link} {each.surface}" for each in value)
        elif isinstance(value, tuple):  # such as inputs
            row[name] = " ".join(f"{each:d}" if isinstance(each, bool) else str(each) for each in value)
        else:
            row[name] = value
    for name in ("parts", "bodies"):
        row.pop(name, None)
    return row


def _part_rows(states: Iterable[Snapshot]) -> Iterator[Row]:
    before: Row = {}
    for state in states:
        for part in state.parts:
            if before.get(part.name) != part:
                before[part.name] = part
                named = {"time_s": state.time_s, "tick": state.tick, "name": part.name, "state": part.state}
                yield named | dict(zip(_FRAME, part.frame, strict=True))
