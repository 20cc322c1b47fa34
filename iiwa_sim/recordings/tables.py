"""A recording as tables: states, parts, dialogue and events, as CSV."""

import csv
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec

from iiwa_sim.controller.state import Snapshot
from iiwa_sim.recordings.read import Recorded
from iiwa_sim.recordings.recordings import RecordingFault
from iiwa_sim.recordings.schemas import DIALOGUE, EVENTS, STATE

_FRAME = ("x_mm", "y_mm", "z_mm", "alpha_rad", "beta_rad", "gamma_rad")
_COLUMNS = {
    **{f"{name}_frame": [f"{name}_{key}" for key in _FRAME] for name in ("flange", "tool", "goal")},
    "cartesian_force": [
        *(f"force_{axis}_n" for axis in "xyz"),
        *(f"torque_{axis}_nm" for axis in "xyz"),
    ],
    "tool_load": [f"tool_load_{name}" for name in ("mass_kg", "x_mm", "y_mm", "z_mm")],
}
"""Columns of fields with several values."""
_UNITS = {
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
        name: [f"{name}_{joint}_{unit}" for joint in recorded.joints] for name, unit in _UNITS.items()
    }
    tables: dict[str, Iterator[Row]] = {
        "state": (_state_row(state, columns) for state in recorded.contents(STATE)),
        "dialogue": map(_fields, recorded.contents(DIALOGUE)),
        "events": map(_fields, recorded.contents(EVENTS)),
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


def _state_row(state: Snapshot, columns: dict[str, list[str]]) -> Row:
    fields, row = msgspec.structs.asdict(state), Row()
    for name, value in fields.items():
        if name in columns:
            row |= zip(columns[name], value, strict=True)
        elif name in ("inputs", "outputs"):
            row[name] = " ".join(str(int(each)) for each in value)
        elif name == "gripper":
            row["gripper_opening_mm"], row["gripper_state"] = (
                ("", "") if value is None else (value.opening_mm, value.state)
            )
        elif name == "link_touches":
            row[name] = "; ".join(f"{each.link} {each.surface}" for each in value)
        elif name == "robot_status":
            row |= {f"robot_status_{key}": each for key, each in value._asdict().items()}
        elif name == "error":
            row |= {"error_code": value.code, "error_reason": value.reason}
        elif name not in ("parts", "bodies"):
            row[name] = value
    return row


def _part_rows(states: Iterable[Snapshot]) -> Iterator[Row]:
    before: Row = {}
    for state in states:
        for part in state.parts:
            if before.get(part.name) != part:
                before[part.name] = part
                named = {"time_s": state.time_s, "tick": state.tick, "name": part.name, "state": part.state}
                yield named | dict(zip(_FRAME, part.frame, strict=True))


def _fields(found: msgspec.Struct) -> Row:
    values = msgspec.structs.asdict(found).items()
    return {name: " ".join(map(str, value)) if isinstance(value, tuple) else value for name, value in values}
