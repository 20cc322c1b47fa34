"""Session of KRC4 messages: calls the controller for each command of protocol/krc4.toml, and replies.

Frames on the wire are in mm and degrees, joint positions in degrees.
"""

from collections.abc import Callable
from math import degrees, radians
from typing import NamedTuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, Refused
from iiwa_sim.controller.io import NUMBER_OUT_OF_RANGE, Io
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.krc4_xml import (
    Broken,
    Element,
    Message,
    XmlStream,
    load_krc4_table,
    reply,
    short_reply,
    understand,
    word_for_word,
    written,
)
from iiwa_sim.protocols.ports import KRC4
from iiwa_sim.protocols.session import OwnMoves, Pending, ProtocolLog
from iiwa_sim.wording import harmless, shortened


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
    """Return True if a number is that of an output; numbers above are inputs. Raises `Refused`."""
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
"""The function for each message, by the name in its tag."""


_MESSAGES_AT_ONCE = 64  # answered in a few milliseconds; then the event loop gets its turn
_LONGEST_TEXT = 200  # of a message in the log

_NO_MESSAGE = Message((0, 0), (), "")


class Krc4Session:
    """One connection to the robot."""

    def __init__(
        self, controller: Controller, log: ProtocolLog, name: str, dialogue: Dialogue | None = None
    ) -> None:
        """`name` identifies this connection in the log and in `dialogue`, which is told every message if
        it is given."""
        self.controller = controller
        self._log = log
        self._name = name
        self._dialogue = dialogue or Dialogue(lambda: controller.tick)
        self._dialogue.event(name, "connected", KRC4)
        self._stream = XmlStream()
        self.waiting: Element | Broken | None = None
        """The waiting message that is answered next."""
        self._next_wire = b""
        self._moves = OwnMoves()
        self._planned = False  # whether the present answer() has planned a move
        self.closing = False
        """True if the stream is broken: the shell sends what is to be sent and closes."""
        self.pending: Pending | None = None
        """Always None: no reply waits."""
        self.awaits = False
        """Always False: from no message of KRC4 is it known that the client waits for the end of its move."""

    def receive(self, data: bytes) -> None:
        """Bytes from the client."""
        if not self.closing:
            self._stream.receive(data)
            self._look_ahead()

    def end(self) -> None:
        """The client sends no more."""
        if not self.closing:
            self._stream.end()
            self._look_ahead()

    def answer(self, most: int = _MESSAGES_AT_ONCE) -> bytes:
        """The replies to the next waiting messages.

        To `most` of them, and only as far as the first move, so that many plans do not keep the robot's
        ticks waiting: to be called again while `waiting`.
        """
        replies: list[bytes] = []
        self._planned = False
        for _ in range(most):
            request, wire, self.waiting = self.waiting, self._next_wire, None
            if request is None:
                break
            if isinstance(request, Broken):
                replies.append(self._break_off(request.reason, wire))
                break
            replies.append(self._reply(request, wire))
            self._look_ahead()
            if self._planned:
                break
        return b"".join(replies)

    def lost(self) -> None:
        """Notice that the connection has gone: stop the robot if a move of this session is pending."""
        self._dialogue.event(self._name, "disconnected")
        self.waiting = None
        self.closing = True
        self._moves.abandon(self.controller, self._log, self._name)

    def move(self, request: MoveRequest) -> None:
        """Take a move of this connection. Raises `Refused`: planning has taken its time also then."""
        self._planned = True
        self._moves.add(self.controller.move(request, self._moves.has_ended))

    def _look_ahead(self) -> None:
        if self.waiting is None:
            self.waiting = self._stream.next()
            if self.waiting is not None:
                self._next_wire = self._stream.wire

    def _break_off(self, reason: str, wire: bytes) -> bytes:
        self.closing = True
        hint = "" if b"<" in wire else "; lines of text go to a robot with --protocol iiwa"
        why = f"{reason}; the connection ends{hint}"
        return self._refuse(_NO_MESSAGE, word_for_word(wire), COMMUNICATION_FAILURE, why)

    def _reply(self, element: Element, wire: bytes) -> bytes:
        message = understand(element)
        log, text = self._log, written(element, wire)
        try:
            answer = self._carry_out(message)
            integers = (message.id, message.command, *answer.integers)
            whole = reply(integers, answer.reals)
        except Refused as refused:
            return self._refuse(message, text, refused.code, refused.reason)
        except Exception as fault:  # an internal error must not cost the client its connection
            log.exception(self._name, _in_log(text), fault)
            told = f"internal error at '{_in_log(text)}', see the log"
            self.controller.record_error(EXECUTION, told)
            return self._refusal(message, text, EXECUTION, told)
        logs = log.wants_commands()
        if logs or self._dialogue.is_heard:
            shown = short_reply(integers, answer.reals)
            if logs:
                log.command(self._name, _in_log(text), shown)
            self._dialogue.exchange(self._name, text, shown, command=_tag(message))
        return whole

    def _refuse(self, message: Message, text: str, code: int, reason: str) -> bytes:
        told = harmless(reason)
        self._log.refused(self._name, _in_log(text), code, told)
        self.controller.record_error(code, told)
        return self._refusal(message, text, code, told)

    def _refusal(self, message: Message, text: str, code: int, reason: str) -> bytes:
        integers = (message.id, -abs(message.command), code)
        shown = short_reply(integers, ())
        self._dialogue.exchange(self._name, text, shown, f"{code} {reason}", _tag(message))
        return reply(integers, ())

    def _carry_out(self, message: Message) -> Answer:
        command = load_krc4_table().get(message.command)
        if message.fault or command is None:
            reason = message.fault or f"no command has the id {message.command}"
            raise Refused(COMMUNICATION_FAILURE, reason)
        return COMMANDS[command.tag](self, message)


def _in_log(text: str) -> str:
    return shortened(text, _LONGEST_TEXT)


def _tag(message: Message) -> str:
    """Return the name of a message, such as GOA; empty if it has none."""
    known = load_krc4_table().get(message.command)
    return "" if known is None else known.tag
