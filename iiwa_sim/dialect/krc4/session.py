"""The KRC4 message protocol: bytes of one connection in, calls on the controller, replies out.

Each message is answered by one, in the order in which they came, with its id and the id of its command. One
that is refused is answered with minus the id of the command, and the number of the error in I2. Bytes that
are no XML are answered with neither id, and end the connection. The session knows no sockets: a shell hands
it bytes and asks for answers while there are messages waiting. More in docs/krc4.md.

Frames on the wire are in mm and degrees, joint positions in degrees.
"""

from collections.abc import Callable
from math import degrees, radians
from typing import NamedTuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, Refused
from iiwa_sim.controller.io import NUMBER_OUT_OF_RANGE, Io
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.dialect.krc4.short import short_reply, word_for_word, written
from iiwa_sim.dialect.krc4.stream import Broken, Element, XmlStream
from iiwa_sim.dialect.krc4.table import Command, Message, load_krc4_table, reply, understand
from iiwa_sim.dialect.ports import KRC4
from iiwa_sim.dialect.wire.dialogue import Dialogue
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.frames import Frame
from iiwa_sim.wording import harmless, shortened

_MESSAGES_AT_ONCE = 64  # answered in a few milliseconds; then the event loop gets its turn
_LONGEST_TEXT = 200  # of a message in the log

_NO_MESSAGE = Message((0, 0), (), "")


class _Answer(NamedTuple):
    """Values of a reply besides the two ids: integers from I2 on, reals from R0 on."""

    integers: tuple[int, ...] = ()
    reals: tuple[float, ...] = ()


class Krc4Session:
    """One connection to the robot."""

    def __init__(
        self, controller: Controller, log: DialectLog, name: str, dialogue: Dialogue | None = None
    ) -> None:
        """`name` identifies this connection in the log and in `dialogue`, which is told every message if
        it is given."""
        self._controller = controller
        self._log = log
        self._name = name
        self._dialogue = dialogue or Dialogue(lambda: controller.tick)
        self._dialogue.event(name, "connected", KRC4)
        self._table = load_krc4_table()
        self._axes = len(controller.description.joints)
        self._full_speeds = [1.0] * self._axes  # no message has a speed or a blending
        self._stream = XmlStream()
        self._next: Element | Broken | None = None
        self._next_wire = b""
        self._moves: set[int] = set()  # of this connection, that have not ended
        self._planned = False  # whether the present answer() has planned a move
        self._closing = False

    @property
    def waiting(self) -> bool:
        """Whether messages wait for an answer."""
        return self._next is not None

    @property
    def closing(self) -> bool:
        """Whether the stream is broken: the shell sends what is to be sent and closes."""
        return self._closing

    @property
    def pending(self) -> None:
        """No reply waits for anything."""
        return

    def receive(self, data: bytes) -> None:
        """Bytes from the client."""
        if not self._closing:
            self._stream.receive(data)
            self._look_ahead()

    def end(self) -> None:
        """The client sends no more."""
        if not self._closing:
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
            request, wire, self._next = self._next, self._next_wire, None
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
        self._next = None
        self._closing = True
        if self._moves:
            self._controller.stop()
            self._log.stopped(self._name, vanished=True)
        self._moves.clear()

    def _look_ahead(self) -> None:
        if self._next is None:
            self._next = self._stream.next()
            if self._next is not None:
                self._next_wire = self._stream.wire

    def _break_off(self, reason: str, wire: bytes) -> bytes:
        self._closing = True
        why = f"{reason}; the connection ends"
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
            told = f"internal fault at '{_in_log(text)}', told in the log"
            self._controller.record_error(EXECUTION, told)
            return self._refusal(message, text, EXECUTION, told)
        if log.commands or self._dialogue.listeners:
            shown = short_reply(integers, answer.reals)
            if log.commands:
                log.command(self._name, _in_log(text), shown)
            self._dialogue.exchange(self._name, text, shown)
        return whole

    def _refuse(self, message: Message, text: str, code: int, reason: str) -> bytes:
        told = harmless(reason)
        self._log.refused(self._name, _in_log(text), code, told)
        self._controller.record_error(code, told)
        return self._refusal(message, text, code, told)

    def _refusal(self, message: Message, text: str, code: int, reason: str) -> bytes:
        integers = (message.id, -abs(message.command), code)
        self._dialogue.exchange(self._name, text, short_reply(integers, ()), f"{code} {reason}")
        return reply(integers, ())

    def _carry_out(self, message: Message) -> _Answer:
        command = self._table.commands.get(message.command)
        if message.fault or command is None:
            reason = message.fault or f"no command has the id {message.command}"
            raise Refused(COMMUNICATION_FAILURE, reason)
        kind = _KINDS.get(command.tag)
        if kind is not None:
            self._planned = True  # a move takes planning time even if it is refused
            target = self._target(command, message)
            move = MoveRequest(kind, target if command.joints else Frame(*target), speeds=self._full_speeds)
            self._moves.add(self._controller.move(move, self._has_ended))
            return _Answer()
        return _OTHERS[command.tag](self._controller, message)

    def _has_ended(self, ending: Ending) -> None:
        self._moves.discard(ending.move)

    def _target(self, command: Command, message: Message) -> tuple[float, ...]:
        """What a move goes to: mm, and angles in rad."""
        if command.joints:
            return tuple(map(radians, message.reals[: self._axes]))
        x_mm, y_mm, z_mm, *angles_deg = message.reals[:6]
        return (x_mm, y_mm, z_mm, *map(radians, angles_deg))


def _in_log(text: str) -> str:
    return shortened(text, _LONGEST_TEXT)


def _stop(controller: Controller, _: Message) -> _Answer:
    controller.stop()
    return _Answer()


def _is_idle(controller: Controller, _: Message) -> _Answer:
    return _Answer((int(not controller.moving),))


def _set_io(controller: Controller, message: Message) -> _Answer:
    number, value = message.integers[2:4]
    if value not in (0, 1):
        raise Refused(COMMUNICATION_FAILURE, f"I3 = {value}: expected 0 or 1")
    io = controller.io
    if _is_output(io, number):
        io.set_output(number, value == 1)
    else:
        io.refuse_input(number - len(io.output_names))
    return _Answer()


def _get_io(controller: Controller, message: Message) -> _Answer:
    number = message.integers[2]
    io = controller.io
    on = io.output(number) if _is_output(io, number) else io.input(number - len(io.output_names))
    return _Answer((0, int(on)))


def _is_output(io: Io, number: int) -> bool:
    """Whether a number is that of an output; numbers above are inputs. Raises `Refused`."""
    outputs, inputs = len(io.output_names), len(io.input_names)
    if not 1 <= number <= outputs + inputs:
        raise Refused(NUMBER_OUT_OF_RANGE, f"no IO {number}: there are 1 to {outputs + inputs}")
    return number <= outputs


def _distance(controller: Controller, _: Message) -> _Answer:
    return _Answer((), (controller.distance_to_goal_mm(),))


def _goal_pose(controller: Controller, _: Message) -> _Answer:
    x_mm, y_mm, z_mm, *angles = controller.goal_frame()
    return _Answer((), (x_mm, y_mm, z_mm, *map(degrees, angles)))


def _goal_axes(controller: Controller, _: Message) -> _Answer:
    return _Answer((), tuple(map(degrees, controller.goal_joints)))


_KINDS = {"LIN": Kind.LIN, "LIA": Kind.LIN, "PTP": Kind.PTP, "PTA": Kind.PTP}
_OTHERS: dict[str, Callable[[Controller, Message], _Answer]] = {
    "STO": _stop,
    "FIN": _is_idle,
    "SIO": _set_io,
    "GIO": _get_io,
    "DIS": _distance,
    "GOP": _goal_pose,
    "GOA": _goal_axes,
}
