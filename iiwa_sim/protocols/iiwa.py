"""The text protocol: calls the controller for each command of protocol/iiwa.toml, and replies.

Parameters come in the table's order and units. Frames on the wire are what `Frame` holds: mm and rad,
intrinsic Z-Y-X.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from iiwa_sim.controller.carrying import ToolLoad
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.requests import JOINT_BLENDING, Kind, MoveRequest, from_quaternion
from iiwa_sim.frames import Frame
from iiwa_sim.motion.springs import CartesianImpedance
from iiwa_sim.protocols.decimals import format_decimals
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.session import LineSession, written
from iiwa_sim.protocols.table import Request, helped, load_table
from iiwa_sim.wording import harmless, shortened

LONGEST_REPLY = 1000
"""Longest reply in bytes.
The public driver reads 1024 bytes at once: after a longer reply it would misread all that follow."""

Values = tuple[float, ...]
Handler = Callable[[LineSession, Request], bytes]


def _move(session: LineSession, request: Request) -> bytes:
    """Make a move, by the kind and the parameters that the table names."""
    command, kind = request.command, Kind(request.command.kind)
    v = {each.name: value for each, value in zip(command.parameters, request.values, strict=True)}

    def given(first: str, *others: str) -> Any:
        return (v[first], *[v[each] for each in others]) if first in v else ()

    target = joints = given("j0", "j1", "j2", "j3", "j4", "j5", "j6")
    if quaternion := given("qx", "qy", "qz", "qw"):
        target = from_quaternion(given("x", "y", "z"), quaternion)
    elif frame := given("x", "y", "z", "alpha", "beta", "gamma"):
        target = Frame(*frame)
    shift = given("dx", "dy", "dz", "dalpha", "dbeta", "dgamma")
    forces = given("fx", "fy", "fz", "tx", "ty", "tz")
    thresholds = v.get("thresholdX"), v.get("thresholdY"), v.get("thresholdZ")
    balanced = tuple(0.0 - force for force in forces)  # which the controller adds
    session.move(
        MoveRequest(
            kind,
            target,
            v.get("speed", 1.0),
            v.get("blending", JOINT_BLENDING if joints and kind is Kind.PTP else 0.0),
            given("v0", "v1", "v2", "v3", "v4", "v5", "v6"),
            shift=Frame(*shift) if shift else None,
            in_tool=command.in_tool,
            redundancy=v.get("r"),
            thresholds=thresholds if "thresholdZ" in v else None,
            compliance=CartesianImpedance(v["stiffness"], balanced) if forces else None,
            hold_nm_per_rad=v.get("joint_stiffness", 0.0),
        )
    )
    return written("done")


def _does(call: Callable[[Controller, Values], None]) -> Handler:
    """Return a handler of a command that takes effect at once and is answered `done`."""

    def handler(session: LineSession, request: Request) -> bytes:
        call(session.controller, request.values)
        return written("done")

    return handler


def _gives(read: Callable[[Controller], Sequence[float]]) -> Handler:
    """Return a handler of a command that is answered by decimals."""
    return lambda session, _: _decimals(tuple(read(session.controller)))


@lru_cache(64)  # within a tick, and while the robot rests, the numbers repeat
def _decimals(values: Values) -> bytes:
    return format_decimals(values) + b"\r\n"


def _counts(read: Callable[[Controller, Values], Sequence[int]]) -> Handler:
    """Return a handler of a command that is answered by integers, with bits as 0 and 1."""
    return lambda session, request: written(
        " ".join(str(int(value)) for value in read(session.controller, request.values))
    )


def _checks(kind: Kind) -> Handler:
    """Return a handler that checks a move to a frame without making it; it takes as long as planning."""

    def handler(session: LineSession, request: Request) -> bytes:
        session.ends_batch = True
        place, redundancy = request.values[:6], (*request.values, None)[6]
        try:
            session.controller.check(MoveRequest(kind, Frame(*place), redundancy=redundancy))
        except Refused as refused:
            return _prose(f"unreachable {refused.code} {request.with_hint(refused.reason)}")
        return written("reachable")

    return handler


def _prose(text: str) -> bytes:
    return written(shortened(harmless(text), LONGEST_REPLY - len("\r\n")))


def _bye(session: LineSession, _: Request) -> bytes:
    session.close()
    if session.controller.moving:
        session.log.stopped(session.name, vanished=False)
    session.controller.stop()
    return written("bye")


def _error(session: LineSession, _: Request) -> bytes:
    last = session.controller.errors.last
    return _prose("0 none" if last is None else f"{last.code} {last.reason}")


COMMANDS: dict[str, Handler] = {
    **{name: _move for name, command in load_table(IIWA).commands.items() if command.kind},
    "hello": lambda _session, _request: written("hello"),
    "bye": _bye,
    "help": lambda session, request: written(helped(session.table, request.phrase)),
    "stop": _does(lambda robot, _: robot.stop()),
    "cancel move": _does(lambda robot, _: robot.cancel_move()),
    "clear queue": _does(lambda robot, _: robot.clear_queue()),
    "is reachable": _checks(Kind.PTP),
    "is lin reachable": _checks(Kind.LIN),
    "get tool frame": _gives(lambda robot: robot.tool_frame()),
    "get flange frame": _gives(lambda robot: robot.flange_frame()),
    "get joint position": _gives(lambda robot: robot.joints),
    "get joint torque": _gives(lambda robot: robot.joint_torque()),
    "get cartesian force": _gives(lambda robot: robot.cartesian_force()),
    "get goal frame": _gives(lambda robot: robot.goal_frame()),
    "get goal joint position": _gives(lambda robot: robot.motions.goal),
    "get distance to goal": _gives(lambda robot: (robot.distance_to_goal_mm(),)),
    "get queue": _counts(lambda robot, _: [robot.motions.behind]),
    "get status": lambda session, _: written("moving" if session.controller.moving else "stopped"),
    "get robot status": _counts(lambda robot, _: robot.status()),
    "get mode": lambda session, _: written(session.controller.mode.value),
    "get error": _error,
    "reset error": _does(lambda robot, _: robot.errors.reset()),
    "set override": _does(lambda robot, v: robot.set_override(v[0])),
    "get override": _gives(lambda robot: (robot.override,)),
    "set collision detection": _does(lambda robot, v: robot.protection.set_collision_detection(v[0], v[1])),
    "get collision detection": _gives(lambda robot: robot.protection.collision_detection),
    "set tool load": _does(
        lambda robot, v: robot.set_tool_load(ToolLoad(v[0], (1e-3 * v[1], 1e-3 * v[2], 1e-3 * v[3])))
    ),
    "get tool load": _gives(lambda robot: robot.tool_load.in_mm()),
    "get input": _counts(lambda robot, v: [robot.io.input(int(v[0]))]),
    "get output": _counts(lambda robot, v: [robot.io.output(int(v[0]))]),
    "get inputs": _counts(lambda robot, _: robot.io.inputs),
    "get outputs": _counts(lambda robot, _: robot.io.outputs),
    "set output": _does(lambda robot, v: robot.io.set_output(int(v[0]), v[1] == 1.0)),
    "set input": _does(lambda robot, v: robot.io.refuse_input(int(v[0]))),
}
