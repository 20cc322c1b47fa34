"""A recording as tables: states, parts, dialogue and events, as CSV."""

import csv
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, islice
from pathlib import Path

import msgspec

from iiwa_sim.controller.handling import PartState
from iiwa_sim.controller.state import Snapshot
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
_LOAD = tuple(f"tool_load_{name}" for name in ("mass_kg", "x_mm", "y_mm", "z_mm"))
Row = dict[str, object]


def write_tables(recorded: Recorded, folder: Path) -> list[Path]:
    """Write a file each for states, dialogue, events and parts, named after the recording; gives their paths.

    The columns carry their units. Parts have a row at the beginning, and one for each state in which they are
    elsewhere; a recording without parts has no file of them. Files that are there are overwritten. Raises
    RecordingFault.
    """
    tables: dict[str, Iterator[Row]] = {
        "state": (_state_row(state, recorded.joints) for state in recorded.contents(STATE)),
        "dialogue": map(_fields, recorded.contents(DIALOGUE)),
        "events": map(_fields, recorded.contents(EVENTS)),
    }
    if any(state.parts for state in islice(recorded.contents(STATE), 1)):
        tables["parts"] = _part_rows(recorded.contents(STATE))
    written = []
    for name, rows in tables.items():
        path = folder / f"{recorded.path.stem}.{name}.csv"
        first = next(rows, {})
        try:
            with path.open("w", encoding="utf-8", newline="") as file:
                writer = csv.DictWriter(file, list(first), lineterminator="\n")
                writer.writeheader()
                writer.writerows(chain([first], rows) if first else ())
        except OSError as fault:
            raise RecordingFault(f"{path}: cannot be written: {fault.strerror}") from None
        written.append(path)
    return written


def _state_row(state: Snapshot, joints: Sequence[str]) -> Row:
    row: Row = {name: getattr(state, name) for name in ("time_s", "tick", "mode", "status")}
    for name, unit in _JOINTS.items():
        values = zip(joints, getattr(state, name), strict=True)
        row |= {f"{name}_{joint}_{unit}": value for joint, value in values}
    for name in _FRAMES:
        row |= {f"{name}_{key}": v for key, v in zip(_FRAME, getattr(state, f"{name}_frame"), strict=True)}
    gripper, touches = state.gripper, (f"{each.link} {each.surface}" for each in state.link_touches)
    return {
        **row,
        **dict(zip(_WRENCH, state.cartesian_force, strict=True)),
        "override": state.override,
        **{f"robot_status_{name}": value for name, value in state.robot_status._asdict().items()},
        **dict(zip(_LOAD, state.tool_load, strict=True)),
        "gripper_opening_mm": "" if gripper is None else gripper.opening_mm,
        "gripper_state": "" if gripper is None else gripper.state,
        "link_touches": "; ".join(touches),
        "inputs": _bits(state.inputs),
        "outputs": _bits(state.outputs),
        "error_code": state.error.code,
        "error_reason": state.error.reason,
    }


def _part_rows(states: Iterable[Snapshot]) -> Iterator[Row]:
    before: dict[str, PartState] = {}
    for state in states:
        for part in state.parts:
            if before.get(part.name) != part:
                before[part.name] = part
                named = {"time_s": state.time_s, "tick": state.tick, "name": part.name, "state": part.state}
                yield named | dict(zip(_FRAME, part.frame, strict=True))


def _bits(states: Sequence[bool]) -> str:
    """`0 1 0`, from number 1 on."""
    return " ".join(str(int(state)) for state in states)


def _fields(found: Spoken | Happened) -> Row:
    values = msgspec.structs.asdict(found).items()
    return {name: " ".join(map(str, value)) if isinstance(value, tuple) else value for name, value in values}
