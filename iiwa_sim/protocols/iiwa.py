"""The text protocol: calls the controller for each command of protocol/iiwa.toml, and replies.

Parameters come in the table's order and units. Frames on the wire are what `Frame` holds: mm and rad,
intrinsic Z-Y-X.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

from iiwa_sim.controller.carrying import ToolLoad
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.requests import JOINT_BLENDING, Kind, MoveRequest, from_quaternion
from iiwa_sim.frames import Frame
from iiwa_sim.motion.springs import CartesianImpedance
from iiwa_sim.protocols.decimals import format_decimals
from iiwa_sim.protocols.session import LineSession, written
from iiwa_sim.protocols.table import Request, helped
from iiwa_sim.wording import harmless, shortened

LONGEST_REPLY = 1000
"""Longest reply in bytes. The public driver reads 1024 bytes at once: a longer reply would put it out of
step for good."""

Values = tuple[float, ...]
Handler = Callable[[LineSession, Request], bytes]


def _move(request_of: Callable[[Values], MoveRequest]) -> Handler:
    """A command that makes a move."""

    def handler(session: LineSession, request: Request) -> bytes:
        session.move(request_of(request.values))
        return written("done")

    return handler


def _to_frame(kind: Kind) -> Callable[[Values], MoveRequest]:
    """A move to a frame, from a frame, a speed, a blending and maybe a redundancy angle."""
    return lambda v: MoveRequest(kind, Frame(*v[:6]), v[6], v[7], redundancy=(*v, None)[8])


def _to_turned(kind: Kind) -> Callable[[Values], MoveRequest]:
    """A move to x y z (mm) and a quaternion."""
    return lambda v: MoveRequest(
        kind, from_quaternion((v[0], v[1], v[2]), (v[3], v[4], v[5], v[6])), v[7], v[8]
    )


def _by_shift(kind: Kind, *, in_tool: bool) -> Callable[[Values], MoveRequest]:
    return lambda v: MoveRequest(kind, speed=v[6], blending=v[7], shift=Frame(*v[:6]), in_tool=in_tool)


def _until_force(kind: Kind) -> Callable[[Values], MoveRequest]:
    """A move that a force along x, y or z ends; with one threshold along z only."""
    return lambda v: MoveRequest(
        kind, Frame(*v[:6]), v[6], v[7], thresholds=(v[8], v[9], v[10]) if len(v) > 9 else (None, None, v[8])
    )


def _compliant(kind: Kind) -> Callable[[Values], MoveRequest]:
    """A compliant move, from a frame, a speed, a stiffness and a wrench, which the controller balances."""

    def request(v: Values) -> MoveRequest:
        fx, fy, fz, tx, ty, tz = (0.0 - value for value in v[8:14])
        impedance = CartesianImpedance(v[7], (fx, fy, fz, tx, ty, tz))
        return MoveRequest(kind, Frame(*v[:6]), v[6], compliance=impedance)

    return request


def _does(call: Callable[[Controller, Values], None]) -> Handler:
    """A command that takes effect at once and is answered `done`."""

    def handler(session: LineSession, request: Request) -> bytes:
        call(session.controller, request.values)
        return written("done")

    return handler


def _gives(read: Callable[[Controller], Sequence[float]]) -> Handler:
    """A command that is answered by decimals."""
    return lambda session, _: _decimals(tuple(read(session.controller)))


@lru_cache(64)  # within a tick, and while the robot rests, the numbers repeat
def _decimals(values: Values) -> bytes:
    return format_decimals(values) + b"\r\n"


def _counts(read: Callable[[Controller, Values], Sequence[int]]) -> Handler:
    """A command that is answered by integers, with bits as 0 and 1."""
    return lambda session, request: written(
        " ".join(str(int(value)) for value in read(session.controller, request.values))
    )


def _checks(kind: Kind) -> Handler:
    """A command that tells whether a move to a frame would be accepted. It takes as long as planning the
    move."""

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
    "hello": lambda _session, _request: written("hello"),
    "bye": _bye,
    "help": lambda session, request: written(helped(session.table, request.phrase, "lin move")),
    "stop": _does(lambda robot, _: robot.stop()),
    "cancel move": _does(lambda robot, _: robot.cancel_move()),
    "clear queue": _does(lambda robot, _: robot.clear_queue()),
    "joint move": _move(lambda v: MoveRequest(Kind.PTP, v[:7], speeds=v[7:], blending=JOINT_BLENDING)),
    "lin joint move": _move(lambda v: MoveRequest(Kind.LIN, v[:7], v[7], v[8])),
    "lin move": _move(_to_frame(Kind.LIN)),
    "ptp move": _move(_to_frame(Kind.PTP)),
    "linr move": _move(_to_frame(Kind.LIN)),
    "ptpr move": _move(_to_frame(Kind.PTP)),
    "lin quaternion move": _move(_to_turned(Kind.LIN)),
    "ptp quaternion move": _move(_to_turned(Kind.PTP)),
    "lin relative move": _move(_by_shift(Kind.LIN, in_tool=False)),
    "lin tool relative move": _move(_by_shift(Kind.LIN, in_tool=True)),
    "ptp relative move": _move(_by_shift(Kind.PTP, in_tool=False)),
    "ptp tool relative move": _move(_by_shift(Kind.PTP, in_tool=True)),
    "linforcez move": _move(_until_force(Kind.LIN)),
    "ptpforcez move": _move(_until_force(Kind.PTP)),
    "linforce move": _move(_until_force(Kind.LIN)),
    "ptpforce move": _move(_until_force(Kind.PTP)),
    "linstiff move": _move(_compliant(Kind.LIN)),
    "ptpstiff move": _move(_compliant(Kind.PTP)),
    "start gravity": _move(lambda v: MoveRequest(Kind.HOLD, hold_nm_per_rad=v[0])),
    "smart joint move": _move(lambda v: MoveRequest(Kind.SMART, v[:7], speeds=v[7:])),
    "smart cartesian move": _move(lambda v: MoveRequest(Kind.SMART, Frame(*v[:6]), v[6])),
    "direct joint move": _move(lambda v: MoveRequest(Kind.DIRECT, v[:7], speeds=v[7:])),
    "direct cartesian move": _move(lambda v: MoveRequest(Kind.DIRECT, Frame(*v[:6]), v[6])),
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
    "get queue": _counts(lambda robot, _: [robot.queue]),
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
    "get tool load": _gives(lambda robot: robot.tool_load.told()),
    "get input": _counts(lambda robot, v: [robot.io.input(int(v[0]))]),
    "get output": _counts(lambda robot, v: [robot.io.output(int(v[0]))]),
    "get inputs": _counts(lambda robot, _: robot.io.inputs),
    "get outputs": _counts(lambda robot, _: robot.io.outputs),
    "set output": _does(lambda robot, v: robot.io.set_output(int(v[0]), v[1] == 1.0)),
    "set input": _does(lambda robot, v: robot.io.refuse_input(int(v[0]))),
}
