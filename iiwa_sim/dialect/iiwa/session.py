r"""The iiwa's line protocol: bytes of one connection in, calls on the controller, replies out.

Each line is answered by one line that ends with `\r\n`, in the order in which they came; whatever a line
holds, and whatever happens in the controller, there is a reply. Telnet's IAC DO TIMING-MARK is answered by
IAC WONT TIMING-MARK in its place among them; all else of telnet is ignored. The session knows no sockets: a
shell hands it bytes and asks for answers while there are lines waiting.
"""

from collections import deque
from collections.abc import Callable, Sequence

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, Refused
from iiwa_sim.controller.poses import from_quaternion
from iiwa_sim.dialect.own_moves import OwnMoves
from iiwa_sim.dialect.ports import IIWA
from iiwa_sim.dialect.wire.decimals import format_decimals, readable
from iiwa_sim.dialect.wire.dialogue import Dialogue
from iiwa_sim.dialect.wire.help import alike, overview, usage
from iiwa_sim.dialect.wire.lines import OVERLONG, TIMING_MARK, WONT_TIMING_MARK, LineSplitter
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.dialect.wire.table import ERROR, UNKNOWN_COMMAND, Refusal, Request, in_degrees, load_table
from iiwa_sim.frames import Frame
from iiwa_sim.wording import harmless, shortened

LONGEST_REPLY = 1000
"""Bytes. The public driver receives 1024 of them at once: a longer reply puts it out of step for good."""

_LINES_AT_ONCE = 512  # answered in a few milliseconds; then the event loop gets its turn
_DONE = b"done\r\n"
_MOVING = b"moving\r\n"
_STOPPED = b"stopped\r\n"
_REFUSALS = (f"{ERROR}\r\n".encode(), f"{UNKNOWN_COMMAND}\r\n".encode())  # told with their reason
_NOT_TOLD = (*_REFUSALS, WONT_TIMING_MARK)

Values = tuple[float, ...]


class Session:
    """One connection to the robot."""

    def __init__(
        self,
        controller: Controller,
        log: DialectLog,
        name: str,
        dialogue: Dialogue | None = None,
        strict: bool = False,
    ) -> None:
        """`name` tells this connection from others in the log and in the dialogue, if somebody hears that.

        Values behind the last parameter of a command are ignored, as by the original, and told in the log
        once for each command; with `strict` they are refused.
        """
        self._controller = controller
        self._log = log
        self._name = name
        self._dialogue = dialogue or Dialogue(lambda: controller.tick)
        self._dialogue.event(name, "connected", IIWA)
        self._table = load_table("iiwa")
        self._splitter = LineSplitter()
        self._lines: deque[bytes] = deque()
        self._moves = OwnMoves(controller.is_pending)
        self._planned = False  # a move, within the present answer()
        self._closing = False
        self._strict = strict
        self._beyond_told: set[str] = set()  # commands with values behind their last parameter
        self._written: dict[str, tuple[Values, bytes]] = {}

    @property
    def waiting(self) -> bool:
        """Whether lines wait for an answer."""
        return bool(self._lines)

    @property
    def closing(self) -> bool:
        """Whether the client has said bye: the shell sends what is to be sent and closes."""
        return self._closing

    def receive(self, data: bytes) -> None:
        """Bytes from the client."""
        if not self._closing:
            self._lines.extend(self._splitter.feed(data))

    def end(self) -> None:
        """The client sends no more; what it sent last counts as a line, with or without a line end."""
        if not self._closing:
            self._lines.extend(self._splitter.finish())

    def answer(self, most: int = _LINES_AT_ONCE) -> bytes:
        r"""The replies to the next waiting lines, each with its `\r\n`.

        To `most` of them, and only as far as the first move, so that a thousand plans do not keep the
        robot's ticks waiting: to be called again while `waiting`.
        """
        lines = self._lines
        log = self._log if self._log.commands else None
        heard = bool(self._dialogue.listeners)
        replies: list[bytes] = []
        self._planned = False
        for _ in range(min(len(lines), most)):
            line = lines.popleft()
            reply = self._reply(line)
            replies.append(reply)
            if log is not None and reply not in _NOT_TOLD:
                log.command(self._name, _text(line), reply[:-2].decode())
            if heard and reply is not WONT_TIMING_MARK:
                self._dialogue.exchange(self._name, _text(line), reply[:-2].decode())
            if self._planned or self._closing:
                break
        return b"".join(replies)

    def lost(self) -> None:
        """The connection has gone: stops the robot if a move of this session is still to be done."""
        self._dialogue.event(self._name, "disconnected")
        self._lines.clear()
        self._closing = True
        if self._moves.any_pending():
            self._controller.stop()
            self._log.stopped(self._name, vanished=True)
        self._moves.clear()

    def _reply(self, line: bytes) -> bytes:
        request = self._table.parse(line)
        log = self._log
        if isinstance(request, Refusal):
            if line is TIMING_MARK:
                return WONT_TIMING_MARK
            return self._refuse(line, request)
        if request.beyond and not self._ignores_beyond(request):
            count = len(request.values) + request.beyond
            reason = f"{request.command.name} takes {request.command.takes()}, got {count}"
            return self._refuse(line, Refusal(ERROR, COMMUNICATION_FAILURE, reason))
        try:
            return self._carry_out(request)
        except Refused as refused:
            return self._refuse(line, Refusal(ERROR, refused.code, refused.reason + in_degrees(request)))
        except Exception as fault:  # a fault of ours must not cost the client its connection
            log.exception(self._name, _text(line), fault)
            self._controller.record_error(EXECUTION, f"internal fault at '{_text(line)}', told in the log")
        return _line(ERROR)

    def _ignores_beyond(self, request: Request) -> bool:
        """Whether values behind the last parameter are ignored; they are told once for each command."""
        name = request.command.name
        if not self._strict and name not in self._beyond_told:
            self._beyond_told.add(name)
            self._log.ignored(self._name, name, request.command.takes(), request.beyond)
        return not self._strict

    def _refuse(self, line: bytes, refusal: Refusal) -> bytes:
        self._log.refused(self._name, _text(line), refusal.code, refusal.reason)
        self._controller.record_error(refusal.code, refusal.reason)
        return _line(refusal.reply)

    def _carry_out(self, request: Request) -> bytes:
        name = request.command.name
        values_of = _VALUES.get(name)
        if values_of is not None:
            return self._write(name, values_of(self._controller))
        if name == "get status":
            return _MOVING if self._controller.moving else _STOPPED
        read = _INTEGERS.get(name)
        if read is not None:
            return _line(" ".join(str(int(value)) for value in read(self._controller, request.values)))
        plan = _MOVES.get(name)
        if plan is not None:
            self._planned = True  # refused or not, it has cost a plan
            self._moves.add(plan(self._controller, request.values))
            return _DONE
        check = _CHECKS.get(name)
        if check is not None:
            self._planned = True
            return self._is_possible(check, request)
        switch = _SWITCHES.get(name)
        if switch is not None:
            switch(self._controller, request.values)
            return _DONE
        return _OTHERS[name](self, request)

    def _is_possible(self, check: Callable[[Controller, Values], None], request: Request) -> bytes:
        try:
            check(self._controller, request.values)
        except Refused as refused:
            return _prose(f"unreachable {refused.code} {refused.reason}{in_degrees(request)}")
        return _line("reachable")

    def _write(self, name: str, values: Sequence[float]) -> bytes:
        # Within a tick, and while the robot rests, the same values are asked for again and again.
        last = self._written.get(name)
        if last is not None and last[0] == values:
            return last[1]
        reply = format_decimals(values) + b"\r\n"
        self._written[name] = (tuple(values), reply)
        return reply

    def _hello(self, _: Request) -> bytes:
        return _line("hello")

    def _bye(self, _: Request) -> bytes:
        self._lines.clear()
        self._closing = True
        if self._controller.moving:
            self._log.stopped(self._name, vanished=False)
        self._controller.stop()
        return _line("bye")

    def _stop(self, _: Request) -> bytes:
        self._controller.stop()
        return _DONE

    def _mode(self, _: Request) -> bytes:
        return _line(self._controller.mode.value)

    def _error(self, _: Request) -> bytes:
        last = self._controller.last_error
        return _prose("0 none" if last is None else f"{last.code} {last.reason}")

    def _help(self, request: Request) -> bytes:
        if not request.phrase:
            return _line(overview(self._table))
        phrase = request.phrase.lower()
        command = self._table.commands.get(phrase)
        if command is None:
            names = alike(self._table, phrase)
            if not names:
                raise Refused(COMMUNICATION_FAILURE, "no such command")
            return _line(f"alike: {names}")
        return _line(usage(command))


def _prose(text: str) -> bytes:
    return _line(shortened(harmless(text), LONGEST_REPLY - len("\r\n")))


def _line(text: str) -> bytes:
    return text.encode("ascii", "backslashreplace") + b"\r\n"


def _text(line: bytes) -> str:
    return "(too long)" if line is OVERLONG else readable(line)


def _turned(values: Values) -> Frame:
    """The frame of x y z (mm) and a quaternion."""
    x, y, z, qx, qy, qz, qw, *_ = values
    return from_quaternion((x, y, z), (qx, qy, qz, qw))


# Frames on the wire are what Frame holds: mm and rad, intrinsic Z-Y-X.
_MOVES: dict[str, Callable[[Controller, Values], int]] = {
    "joint move": lambda controller, v: controller.joint_move(v[:7], v[7:]),
    "lin joint move": lambda controller, v: controller.lin_joint_move(v[:7], v[7], v[8]),
    "lin move": lambda controller, v: controller.lin_move(Frame(*v[:6]), v[6], v[7]),
    "ptp move": lambda controller, v: controller.ptp_move(Frame(*v[:6]), v[6], v[7]),
    "linr move": lambda controller, v: controller.lin_move(Frame(*v[:6]), v[6], v[7], v[8]),
    "ptpr move": lambda controller, v: controller.ptp_move(Frame(*v[:6]), v[6], v[7], v[8]),
    "lin quaternion move": lambda controller, v: controller.lin_move(_turned(v), v[7], v[8]),
    "ptp quaternion move": lambda controller, v: controller.ptp_move(_turned(v), v[7], v[8]),
    "lin relative move": lambda controller, v: controller.lin_relative_move(
        Frame(*v[:6]), v[6], v[7], in_tool=False
    ),
    "lin tool relative move": lambda controller, v: controller.lin_relative_move(
        Frame(*v[:6]), v[6], v[7], in_tool=True
    ),
    "ptp relative move": lambda controller, v: controller.ptp_relative_move(
        Frame(*v[:6]), v[6], v[7], in_tool=False
    ),
    "ptp tool relative move": lambda controller, v: controller.ptp_relative_move(
        Frame(*v[:6]), v[6], v[7], in_tool=True
    ),
    "linforcez move": lambda controller, v: controller.lin_force_move(
        Frame(*v[:6]), v[6], v[7], (None, None, v[8])
    ),
    "ptpforcez move": lambda controller, v: controller.ptp_force_move(
        Frame(*v[:6]), v[6], v[7], (None, None, v[8])
    ),
    "linforce move": lambda controller, v: controller.lin_force_move(
        Frame(*v[:6]), v[6], v[7], (v[8], v[9], v[10])
    ),
    "ptpforce move": lambda controller, v: controller.ptp_force_move(
        Frame(*v[:6]), v[6], v[7], (v[8], v[9], v[10])
    ),
    "linstiff move": lambda controller, v: controller.lin_stiff_move(Frame(*v[:6]), v[6], v[7], v[8:]),
    "ptpstiff move": lambda controller, v: controller.ptp_stiff_move(Frame(*v[:6]), v[6], v[7], v[8:]),
    "start gravity": lambda controller, v: controller.start_gravity(v[0]),
    "smart joint move": lambda controller, v: controller.smart_joint_move(v[:7], v[7:]),
    "smart cartesian move": lambda controller, v: controller.smart_cartesian_move(Frame(*v[:6]), v[6]),
    "direct joint move": lambda controller, v: controller.direct_joint_move(v[:7], v[7:]),
    "direct cartesian move": lambda controller, v: controller.direct_cartesian_move(Frame(*v[:6]), v[6]),
}
_VALUES: dict[str, Callable[[Controller], Sequence[float]]] = {
    "get tool frame": lambda controller: controller.tool_frame(),
    "get flange frame": lambda controller: controller.flange_frame(),
    "get joint position": lambda controller: controller.joints,
    "get joint torque": lambda controller: controller.joint_torque(),
    "get cartesian force": lambda controller: controller.cartesian_force(),
    "get override": lambda controller: (controller.override,),
    "get goal frame": lambda controller: controller.goal_frame(),
    "get goal joint position": lambda controller: controller.goal_joints,
    "get distance to goal": lambda controller: (controller.distance_to_goal_mm(),),
}
_INTEGERS: dict[str, Callable[[Controller, Values], Sequence[int]]] = {
    "get queue": lambda controller, _: [controller.queue],
    "get robot status": lambda controller, _: controller.status(),
    "get input": lambda controller, v: [controller.io.input(int(v[0]))],
    "get output": lambda controller, v: [controller.io.output(int(v[0]))],
    "get inputs": lambda controller, _: controller.io.inputs,
    "get outputs": lambda controller, _: controller.io.outputs,
}
_CHECKS: dict[str, Callable[[Controller, Values], None]] = {
    "is reachable": lambda controller, v: controller.check_reach(Frame(*v[:6]), *v[6:]),
    "is lin reachable": lambda controller, v: controller.check_line(Frame(*v[:6]), *v[6:]),
}
_SWITCHES: dict[str, Callable[[Controller, Values], None]] = {
    "cancel move": lambda controller, _: controller.cancel_move(),
    "clear queue": lambda controller, _: controller.clear_queue(),
    "set override": lambda controller, v: controller.set_override(v[0]),
    "reset error": lambda controller, _: controller.reset_error(),
    "set output": lambda controller, v: controller.io.set_output(int(v[0]), v[1] == 1.0),
    "set input": lambda controller, v: controller.io.refuse_input(int(v[0])),
}
_OTHERS: dict[str, Callable[[Session, Request], bytes]] = {
    "hello": Session._hello,
    "bye": Session._bye,
    "stop": Session._stop,
    "help": Session._help,
    "get mode": Session._mode,
    "get error": Session._error,
}
