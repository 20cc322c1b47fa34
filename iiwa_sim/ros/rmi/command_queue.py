"""The order of commands: when each is sent to the robot, and the result that each gets.

Every command gets one result, in the order of the commands. When one fails, later commands are not carried
out, since they begin where it should have ended; their results say so.
"""

from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

from iiwa_sim.controller.errors import EXECUTION, STOP_TRIGGERED, SUCCESS, Refused
from iiwa_sim.controller.requests import Kind
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.ros.rmi.commands import read_command
from iiwa_sim.ros.rmi.robot import Move, Robot

LONGEST_QUEUE = 1000
"""Commands that have no result yet; more are refused."""


class Result(NamedTuple):
    """The result of a command."""

    command_id: int
    code: int
    """0 for success, else a result code of robot_movement_interface."""
    information: str


RESULTS_AT_ONCE = 50
"""Results published in one tick; more wait for the next tick."""


class _Command:
    """A command whose result is not published yet."""

    def __init__(self, message: Any) -> None:
        self.id: int = message.command_id
        self.message = message
        self.move: Move | None = None
        self.result: Result | None = None

    def end(self, code: int, information: str) -> None:
        """End the command; only the first end counts, as a robot may report on a replaced command later."""
        if self.result is None:
            self.result = Result(self.id, code, information)


class CommandQueue:
    """The commands of one robot.

    Plain LIN and PTP moves are sent ahead, so that the robot can blend them. Any other command waits until
    those before it have ended, and later commands wait for it: a servo move would replace the running move,
    and a force move compares with the forces at its command.
    """

    def __init__(
        self,
        robot: Robot,
        publish: Callable[[Result], None],
        log: ProtocolLog,
        *,
        apply_reference: bool = True,
    ) -> None:
        """`apply_reference` says whether a pose_reference_frame is applied."""
        self._robot = robot
        self._apply_reference = apply_reference
        self._log = log
        self._publish = publish
        self._begun: deque[_Command] = deque()  # sent or refused; not published
        self._waiting: deque[_Command] = deque()  # not sent yet
        self._servo: Kind | None = None  # the command whose target the servo follows
        self._failed = False

    def take(self, commands: Sequence[Any], *, replace: bool) -> None:
        """Take a CommandList: its commands follow those before, or with `replace` take their place.

        An empty list with `replace` stops the robot.
        """
        if replace:
            follows = (
                bool(commands) and self._servo is not None and commands[0].command_type == self._servo.value
            )
            self._end_all("replaced by a newer list of commands")
            if not follows:  # a servo takes a new target without stopping
                self._stop()
        room = max(0, LONGEST_QUEUE - len(self._begun) - len(self._waiting))
        self._waiting.extend(map(_Command, commands[:room]))
        for message in commands[room:]:
            reason = f"not taken: {LONGEST_QUEUE} commands have no result yet"
            self._publish(Result(message.command_id, EXECUTION, reason))

    def cancel(self, reason: str) -> None:
        """Stop the robot and drop all commands."""
        self._end_all(reason)
        self._stop()

    @property
    def is_active(self) -> bool:
        """Whether a coming tick will send a command or publish a result."""
        if self._begun:
            return self._begun[0].result is not None or self._failed
        return bool(self._waiting) and self._robot.ready

    @property
    def empty(self) -> bool:
        """Whether every command has its result, and no tick has anything to do."""
        return not (self._begun or self._waiting or self._failed)

    def step(self) -> None:
        """Notice a tick: send commands whose time has come, and publish results."""
        if self._failed:
            self._failed = False
            self._stop_what_went_on()
        if self._waiting and self._robot.ready:
            self._send_next()
        self._publish_ended()

    def _send_next(self) -> None:
        command = self._waiting[0]
        if command.move is None:
            try:
                command.move = read_command(
                    command.message, len(self._robot.joint_names), apply_reference=self._apply_reference
                )
            except Refused as refused:
                self._begun.append(self._waiting.popleft())
                self._end(command, refused.code, refused.reason)
                return
        last = next((other.move for other in reversed(self._begun) if other.result is None), None)
        if last is not None and not (_is_plain(last) and _is_plain(command.move)):
            return
        self._begun.append(self._waiting.popleft())
        self._servo = command.move.kind if command.move.kind.is_servo else None
        self._robot.move(command.move, partial(self._end, command))

    def _end(self, command: _Command, code: int, information: str) -> None:
        if command.result is not None:
            return
        if command.move is not None and command.move.note:
            information = f"{information}; {command.move.note}" if information else command.move.note
        command.end(code, information)
        if code != SUCCESS:
            self._failed = True
            if code != STOP_TRIGGERED:
                self._log.refused("ros", f"command {command.id}", code, information)
            for other in self._waiting:
                other.end(code, f"not carried out, after command {command.id}: {information}")
            self._begun.extend(self._waiting)
            self._waiting.clear()

    def _end_all(self, reason: str) -> None:
        self._begun.extend(self._waiting)
        self._waiting.clear()
        for command in self._begun:
            command.end(STOP_TRIGGERED, reason)
        self._publish_ended()

    def _stop_what_went_on(self) -> None:
        """Stop what goes on after a failed command: moves sent ahead, or a servo whose next target was
        refused."""
        running = [command for command in self._begun if command.result is None]
        failed = next((command for command in self._begun if command.result and command.result.code), None)
        goes_on = (
            bool(running)
            and failed is not None
            and self._begun.index(failed) < self._begun.index(running[-1])
        )
        if goes_on or (self._servo is not None and not running):
            self._stop()

    def _stop(self) -> None:
        self._servo = None
        self._robot.stop()

    def _publish_ended(self) -> None:
        """Publish some of the results that are ready; a long list is spread over ticks."""
        for _ in range(RESULTS_AT_ONCE):
            if not self._begun or (result := self._begun[0].result) is None:
                break
            self._begun.popleft()
            self._publish(result)


def _is_plain(move: Move) -> bool:
    return not move.kind.is_servo and move.thresholds_n is None
