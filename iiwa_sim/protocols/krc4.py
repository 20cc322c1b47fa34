"""Session of KRC4 messages: calls the controller for each command of protocol/krc4.toml, and replies.

Frames on the wire are in mm and degrees, joint positions in degrees.
"""

from collections.abc import Callable, Sequence
from math import degrees, radians

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.frames import Frame
from iiwa_sim.log import SessionLog
from iiwa_sim.protocols.krc4_xml import (
    TAGS,
    Element,
    Message,
    XmlStream,
    reply_of,
    to_xml,
    understand,
    written,
)
from iiwa_sim.protocols.ports import KRC4
from iiwa_sim.protocols.session import Session
from iiwa_sim.wording import harmless, shortened

Answer = tuple[Sequence[int], Sequence[float]]
"""Values of a reply besides the two ids: integers from I2 on, reals from R0 on."""
Handler = Callable[["Krc4Session", Message], Answer]

_LONGEST_TEXT = 200  # of a message in the log
_DONE: Answer = (), ()


def _move(kind: Kind, *, to_joints: bool = False) -> Handler:
    """Return a handler of moves to a frame or to a joint position; no message has a speed or a blending."""

    def handler(session: "Krc4Session", message: Message) -> Answer:
        axes = len(session.controller.description.joints)
        joints = tuple(map(radians, message.reals[:axes]))
        frame = Frame(*message.reals[:3], *map(radians, message.reals[3:6]))
        target, speeds = (joints, [1.0] * axes) if to_joints else (frame, [])
        session.move(MoveRequest(kind, target, speeds=speeds))
        return _DONE

    return handler


def _stop(session: "Krc4Session", _: Message) -> Answer:
    session.controller.stop()
    return _DONE


def _set_io(session: "Krc4Session", message: Message) -> Answer:
    (number, value), io = message.integers[2:4], session.controller.io
    if value not in (0, 1):
        raise Refused(COMMUNICATION_FAILURE, f"I3 = {value}: expected 0 or 1")
    if number > len(io.output_names):
        io.refuse_input(number - len(io.output_names))
    io.set_output(number, value == 1)
    return _DONE


def _get_io(session: "Krc4Session", message: Message) -> Answer:
    number, io = message.integers[2], session.controller.io
    outputs = len(io.output_names)
    return (0, int(io.output(number) if number <= outputs else io.input(number - outputs))), ()


def _goal_pose(session: "Krc4Session", _: Message) -> Answer:
    x_mm, y_mm, z_mm, *angles = session.controller.goal_frame()
    return (), (x_mm, y_mm, z_mm, *map(degrees, angles))


COMMANDS: dict[str, Handler] = {
    "LIN": _move(Kind.LIN),
    "LIA": _move(Kind.LIN, to_joints=True),
    "PTP": _move(Kind.PTP),
    "PTA": _move(Kind.PTP, to_joints=True),
    "STO": _stop,
    "FIN": lambda session, _: ((int(not session.controller.moving),), ()),
    "SIO": _set_io,
    "GIO": _get_io,
    "DIS": lambda session, _: ((), (session.controller.distance_to_goal_mm(),)),
    "GOP": _goal_pose,
    "GOA": lambda session, _: ((), tuple(map(degrees, session.controller.motions.goal))),
}
"""The function for each message, by the name in its tag."""


class Krc4Session(Session):
    """One connection to the robot. It does not `await`: clients ask for all kinds of values."""

    def __init__(
        self, controller: Controller, log: SessionLog, name: str, dialogue: Dialogue | None = None
    ) -> None:
        super().__init__(controller, log, name, dialogue, KRC4)
        self._stream = XmlStream()
        self.waiting = None

    def receive(self, data: bytes) -> None:
        self._stream.receive(data)
        self._look_ahead()

    def end(self) -> None:
        self._stream.end()
        self._look_ahead()

    def _answer(self) -> bytes:
        element, self.waiting = self.waiting, None
        reply = self._reply(element, self._stream.wire)
        self._look_ahead()
        return reply

    def _look_ahead(self) -> None:
        if self.waiting is None:
            self.waiting = self._stream.next()

    def _reply(self, element: Element, wire: bytes) -> bytes:
        message, text, why = understand(element), written(element, wire), ""
        tag, shown = TAGS.get(message.command, ""), shortened(text, _LONGEST_TEXT)
        try:
            if element.breaks:
                self.close()
                is_text = wire and b"<" not in wire
                hint = "; lines of text go to a robot with --protocol iiwa" if is_text else ""
                raise Refused(COMMUNICATION_FAILURE, f"{element.fault}; the connection ends{hint}")
            if message.fault or not tag:
                reason = message.fault or f"no command has the id {message.command}"
                raise Refused(COMMUNICATION_FAILURE, reason)
            integers, reals = COMMANDS[tag](self, message)
            answer = reply_of((message.id, message.command, *integers), reals)
        except Exception as fault:  # an internal error must not cost the client its connection
            if not isinstance(fault, Refused):
                self.log.exception(self.name, shown, fault)
                fault = Refused(EXECUTION, f"internal error at '{shown}', see the log")
            reason = harmless(fault.reason)
            self.log.refused(self.name, shown, fault.code, reason)
            self.controller.errors.record(fault.code, reason)
            answer = reply_of((message.id, -abs(message.command), fault.code), ())
            why = f"{fault.code} {reason}"
        if self.dialogue.is_active:
            self.dialogue.exchange(self.name, text, written(answer), why, tag)
        return to_xml(answer)
