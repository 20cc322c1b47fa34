"""A robot behind a connection, with the interface `Robot` of the ROS side: it is polled and commanded.

Only the commands of Appendix B are required. Extensions are used where the server has them. Without `get
queue` the results of moves sent ahead come together when the robot has stopped; without `get error` a refusal
has no reason; without the others override, IO and most of the robot status are unknown, and services say so.
"""

from collections import deque
from collections.abc import Awaitable, Callable
from functools import partial
from typing import NamedTuple, TypeVar

from iiwa_sim.client import AsyncIiwa, CommandError, ReplyError, UnknownCommandError
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, STOP_TRIGGERED, SUCCESS, Refused
from iiwa_sim.controller.status import RobotStatus
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.ros.bridge.moves import as_frame, is_there, sending
from iiwa_sim.ros.rmi.pins import UNKNOWN
from iiwa_sim.ros.rmi.robot import Done, Ended, Failure, Joints, Move, State

SHORT_OF_TARGET_ASKED = 50
"""Number of polls in a row that have to show the robot at rest short of its target before its move has
failed: some robots report `stopped` for a while before they start."""
UNKNOWN_STATE = -1
"""The value for unknown in industrial_msgs."""
UNKNOWN_STATUS = RobotStatus._make([*[UNKNOWN_STATE] * 6, 0])
OWN_ACCELERATION = "the robot took its own acceleration"
"""Note on a move with an acceleration cap, which the protocol of Appendix B cannot express."""
OUT_OF_REACH = UNKNOWN_STATUS._replace(motion_possible=0, in_error=1, error_code=COMMUNICATION_FAILURE)
"""Status while there is no connection: what the robot does is unknown, and commands get this code."""
IO_EVERY = 10
"""Inputs and outputs are polled in every tenth round only."""

T = TypeVar("T")


class _Sent(NamedTuple):
    """A move that the robot has accepted."""

    move: Move
    ended: Ended


class _Asked(NamedTuple):
    """A request that is not carried out yet."""

    do: Callable[[], Awaitable[None]]
    fail: Callable[[Failure], None]
    """Reports that the request failed for want of a connection."""


class RemoteRobot:
    """A robot at the other end of a client. `do_asked` and `look` are to be awaited in turns.

    Both raise OSError or ReplyError when the connection fails; then call `give_up`.
    """

    def __init__(self, client: AsyncIiwa, description: RobotDescription) -> None:
        """`description` gives names and velocity limits of the joints."""
        self._client = client
        self.description = description
        self._state: State | None = None
        self._status: RobotStatus | None = None
        self._asked: deque[_Asked] = deque()
        self._sent: deque[_Sent] = deque()
        self._moves_asked = 0
        self._target: tuple[Joints, tuple[float, ...]] | None = None  # of a direct move that is not sent yet
        self._rests = False  # the next move has to wait until the robot rests
        self._short = 0  # how often in a row the robot stood short of its target
        self._absent: set[str] = set()
        self._rounds = 0
        self._gone: Failure | None = None  # why there is no connection; None while there is one

    @property
    def joint_names(self) -> tuple[str, ...]:
        return self.description.joints

    @property
    def ready(self) -> bool:
        if self._gone is not None:
            return True  # refused: nobody expects the robot to move when the connection is back
        state = self._state
        waits = self._moves_asked > 0 or (self._rests and bool(self._sent))
        return state is not None and state.override != 0.0 and not waits

    @property
    def state(self) -> State | None:
        return self._state

    @property
    def status(self) -> RobotStatus | None:
        return self._status

    def move(self, move: Move, ended: Ended) -> None:
        def fail(failure: Failure) -> None:
            self._moves_asked -= 1
            ended(failure.code, failure.reason)

        self._moves_asked += 1
        self._ask(lambda: self._send(move, ended), fail)

    def stop(self, done: Done) -> None:
        async def stop() -> None:
            failure = await self._do(self._client.stop())
            if failure is None:
                self._end_all(STOP_TRIGGERED, "stopped")
            done(failure)

        self._ask(stop, done)

    def set_override(self, override: float, done: Done) -> None:
        async def set_override() -> None:
            done(await self._do(self._client.set_override(override)))

        self._ask(set_override, done)

    def reset_error(self, done: Done) -> None:
        """End the error state, if the server has a command for it."""

        async def reset() -> None:
            done(await self._do(self._client.reset_error()))

        self._ask(reset, done)

    def send_target(self, joints: Joints, speeds_rel: tuple[float, ...], refused: Done) -> None:
        """Head for near joint positions (rad) by a direct move; of targets that wait only the newest is sent.

        `refused` is called with why one was not taken.
        """
        waits = self._target is not None
        self._target = joints, speeds_rel

        async def send() -> None:
            target, self._target = self._target, None
            if target is None:
                return
            failure = await self._do(self._client.direct_joint_move(*target))
            if failure is None:
                self._end_all(STOP_TRIGGERED, "replaced by a newer target")
            else:
                refused(failure)

        if not waits:
            self._ask(send, refused)

    def set_output(self, number: int, on: bool, done: Done) -> None:
        async def set_output() -> None:
            failure = await self._do(self._client.set_output(number, on))
            await self._look_at_io()
            done(None if failure is None else Failure(UNKNOWN, failure.reason))

        self._ask(set_output, done)

    async def do_asked(self) -> None:
        """Carry out the pending requests."""
        while self._asked:
            await self._asked[0].do()
            self._asked.popleft()

    def give_up(self, reason: str) -> None:
        """The connection has failed: fail all pending requests, and those that come before the next
        successful `look`."""
        self._state, self._status, self._rounds = None, OUT_OF_REACH, 0
        self._absent.clear()  # the next connection may lead to another server
        self._gone = Failure(COMMUNICATION_FAILURE, reason)
        self._target = None
        self._end_all(*self._gone)
        while self._asked:
            self._asked.popleft().fail(self._gone)

    def _ask(self, do: Callable[[], Awaitable[None]], fail: Callable[[Failure], None]) -> None:
        if self._gone is None:
            self._asked.append(_Asked(do, fail))
        else:
            fail(self._gone)

    async def _send(self, move: Move, ended: Ended) -> None:
        rests = False
        try:
            send, rests = sending(move, self.description)
            failure = await self._do(send(self._client))
        except Refused as refused:
            failure = Failure(refused.code, refused.reason)
        self._moves_asked -= 1
        if failure is not None:
            ended(failure.code, failure.reason)
            return
        if move.kind.is_servo:  # a servo target replaces the one before
            self._end_all(STOP_TRIGGERED, "replaced by a newer target")
        if move.acceleration is not None:
            ended = partial(_own_acceleration, ended)
        self._sent.append(_Sent(move, ended))
        self._rests, self._short = rests, 0

    async def look(self) -> None:
        """Poll the robot's state, and find out which moves have ended."""
        client = self._client
        behind = None if len(self._sent) < 2 else await self._if_there("get queue", client.get_queue)
        moving = await client.get_status() == "moving"
        joints = tuple(await client.get_joint_position())
        if len(joints) != len(self.joint_names):
            expected = f"{self.description.name}, as which it is bridged, has {len(self.joint_names)}"
            raise ReplyError(f"it has {len(joints)} joints, {expected}")
        tool_frame = as_frame(await client.get_tool_frame())
        told = await self._if_there("get robot status", client.get_robot_status)
        override = await self._if_there("get override", client.get_override)
        self._gone = None  # state and readiness change together: who sees the one relies on the other
        only_this = UNKNOWN_STATUS._replace(in_motion=int(moving))
        self._status = only_this if told is None else RobotStatus(*told)
        self._state = State(
            joints=joints,
            velocities=None,
            tool_frame=tool_frame,
            override=override,
            inputs=None if self._state is None else self._state.inputs,
            outputs=None if self._state is None else self._state.outputs,
        )
        if self._rounds % IO_EVERY == 0:
            await self._look_at_io()
        self._rounds += 1
        if moving:
            self._short = 0
            if behind is not None:
                while len(self._sent) > behind + 1:
                    self._sent.popleft().ended(SUCCESS, "")
        elif self._sent:
            await self._has_stopped(self._state)

    async def _look_at_io(self) -> None:
        inputs = await self._if_there("get inputs", self._client.get_inputs)
        outputs = await self._if_there("get outputs", self._client.get_outputs)
        if self._state is not None:
            self._state = self._state._replace(inputs=inputs, outputs=outputs)

    async def _has_stopped(self, state: State) -> None:
        """End the moves that were sent ahead: all are done if the last one is."""
        if await is_there(self._client, self._sent[-1].move, state.joints, state.tool_frame):
            self._end_all(SUCCESS, "")
            return
        self._short += 1
        if self._short >= SHORT_OF_TARGET_ASKED:
            error = None
            # Without an error state the last error may stem from any earlier refusal.
            if self._status is not None and self._status.in_error == 1:
                error = await self._if_there("get error", self._client.get_error)
            self._end_all(*(error or (STOP_TRIGGERED, "the robot has stopped short of the target")))

    async def _do(self, command: Awaitable[None]) -> Failure | None:
        """Send a command; returns why it was refused, None if it was not."""
        try:
            await command
        except UnknownCommandError:
            return Failure(EXECUTION, "the robot does not know this command")
        except ValueError as fault:  # ValueError of the client, which sends no numbers that are not finite
            return Failure(EXECUTION, str(fault))
        except CommandError:
            error = await self._if_there("get error", self._client.get_error)
            return Failure(EXECUTION, "refused, the robot says no more") if error is None else Failure(*error)
        return None

    async def _if_there(self, name: str, ask: Callable[[], Awaitable[T]]) -> T | None:
        """The answer to an extension; None, from then on, if the server does not know the command."""
        if name in self._absent:
            return None
        try:
            return await ask()
        except CommandError:
            self._absent.add(name)
            return None

    def _end_all(self, code: int, reason: str) -> None:
        self._rests, self._short = False, 0
        while self._sent:
            self._sent.popleft().ended(code, reason)


def _own_acceleration(ended: Ended, code: int, information: str) -> None:
    ended(code, information or (OWN_ACCELERATION if code == SUCCESS else ""))
