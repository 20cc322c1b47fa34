"""What each command of protocol/krc4.toml calls on the controller, and what the reply holds.

Frames on the wire are in mm and degrees, joint positions in degrees.
"""

from collections.abc import Callable
from math import degrees, radians
from typing import TYPE_CHECKING, NamedTuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.controller.io import NUMBER_OUT_OF_RANGE, Io
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.krc4.table import Message

if TYPE_CHECKING:
    from iiwa_sim.protocols.krc4.session import Krc4Session


class Answer(NamedTuple):
    """Values of a reply besides the two ids: integers from I2 on, reals from R0 on."""

    integers: tuple[int, ...] = ()
    reals: tuple[float, ...] = ()


Handler = Callable[["Krc4Session", Message], Answer]


def _to_frame(kind: Kind) -> Handler:
    """A handler of moves to a frame; no message has a speed or a blending."""

    def handler(session: "Krc4Session", message: Message) -> Answer:
        x_mm, y_mm, z_mm, alpha, beta, gamma = message.reals[:6]
        target = Frame(x_mm, y_mm, z_mm, radians(alpha), radians(beta), radians(gamma))
        session.move(MoveRequest(kind, target))
        return Answer()

    return handler


def _to_joints(kind: Kind) -> Handler:
    """A handler of moves to joint positions, one for each axis of the robot."""

    def handler(session: "Krc4Session", message: Message) -> Answer:
        axes = len(session.controller.description.joints)
        target = tuple(map(radians, message.reals[:axes]))
        session.move(MoveRequest(kind, target, speeds=[1.0] * axes))
        return Answer()

    return handler


def _asks(read: Callable[[Controller], Answer]) -> Handler:
    """A handler of commands that take no parameters."""
    return lambda session, _: read(session.controller)


def _stop(session: "Krc4Session", _: Message) -> Answer:
    session.controller.stop()
    return Answer()


def _set_io(session: "Krc4Session", message: Message) -> Answer:
    number, value = message.integers[2:4]
    if value not in (0, 1):
        raise Refused(COMMUNICATION_FAILURE, f"I3 = {value}: expected 0 or 1")
    io = session.controller.io
    if _is_output(io, number):
        io.set_output(number, value == 1)
    else:
        io.refuse_input(number - len(io.output_names))
    return Answer()


def _get_io(session: "Krc4Session", message: Message) -> Answer:
    number = message.integers[2]
    io = session.controller.io
    on = io.output(number) if _is_output(io, number) else io.input(number - len(io.output_names))
    return Answer((0, int(on)))


def _is_output(io: Io, number: int) -> bool:
    """Whether a number is that of an output; numbers above are inputs. Raises `Refused`."""
    outputs, inputs = len(io.output_names), len(io.input_names)
    if not 1 <= number <= outputs + inputs:
        raise Refused(NUMBER_OUT_OF_RANGE, f"no IO {number}: there are 1 to {outputs + inputs}")
    return number <= outputs


def _goal_pose(controller: Controller) -> Answer:
    x_mm, y_mm, z_mm, *angles = controller.goal_frame()
    return Answer((), (x_mm, y_mm, z_mm, *map(degrees, angles)))


COMMANDS: dict[str, Handler] = {
    "LIN": _to_frame(Kind.LIN),
    "LIA": _to_joints(Kind.LIN),
    "PTP": _to_frame(Kind.PTP),
    "PTA": _to_joints(Kind.PTP),
    "STO": _stop,
    "FIN": _asks(lambda robot: Answer((int(not robot.moving),))),
    "SIO": _set_io,
    "GIO": _get_io,
    "DIS": _asks(lambda robot: Answer((), (robot.distance_to_goal_mm(),))),
    "GOP": _asks(_goal_pose),
    "GOA": _asks(lambda robot: Answer((), tuple(map(degrees, robot.goal_joints)))),
}
"""What carries out each message, by the name in its tag."""
