"""The backdoor: calls of a test bench on robot, cell, time and wire.

The first paragraphs of the docstrings are the table of docs/backdoor.md and of `GET /`.
"""

import time
from asyncio import wrap_future
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from math import isfinite
from typing import Concatenate, ParamSpec, Protocol, TypeVar, get_args

import msgspec

from iiwa_sim.backdoor import surfaces
from iiwa_sim.backdoor.described import (
    DescribedCell,
    DescribedMoves,
    DescribedRobot,
    described_cell,
    described_moves,
    described_robot,
)
from iiwa_sim.backdoor.states import States
from iiwa_sim.camera import HEIGHT, WIDTH, Camera
from iiwa_sim.cell.bodies import AnySurface
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.clock.clock import Clock, StillMoving
from iiwa_sim.clock.pace import pace
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.controller.errors import EXECUTION, STOP_TRIGGERED, ErrorRecord, Refused
from iiwa_sim.controller.handling import Handling
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.dialogue import Dialogue, RecentLines
from iiwa_sim.frames import IDENTITY, Frame, compose
from iiwa_sim.protocols.faults import (
    EVERY,
    LONGEST_WAIT_S,
    UNTIL_CLEARED,
    Close,
    Fault,
    Reset,
    Silence,
    WireFaults,
)
from iiwa_sim.robot.description import ToolSettings
from iiwa_sim.server.listening import Acceptor
from iiwa_sim.settings import Reader
from iiwa_sim.wording import distinct, harmless, shortened
from iiwa_sim.wrench import NO_WRENCH, Wrench

PROTECTIVE_STOP = "protective stop"
ON_PURPOSE = "made to fail through the backdoor"
MOST_MOVES = 50
"""Moves that `moves` returns at most."""
LONGEST_TEXT = 200
"""Characters of a call in the dialogue."""
HERE = "backdoor"
"""The name in the dialogue of a program that has the simulator in its own process and acts."""
DRAGGED = ("push", "push_joints", "move_surface")
"""Methods that a client calls many times a second while somebody drags the arm."""
DRAGGED_S = 1.0
"""Time (s) in which the dialogue has at most one of these calls."""

P = ParamSpec("P")
T = TypeVar("T")


class Call(Protocol):
    """Calls a function in the simulator's event loop; returns its result, or raises what it raises."""

    def __call__(self, function: Callable[[], T]) -> T: ...


def called(
    method: Callable[Concatenate["Backdoor", P], T],
) -> Callable[Concatenate["Backdoor", P], T]:
    """Decorator: the method runs in the simulator's event loop, between two ticks."""

    @wraps(method)
    def call(self: "Backdoor", /, *args: P.args, **kwargs: P.kwargs) -> T:
        return self.call(lambda: method(self, *args, **kwargs))

    return call


def acts(
    method: Callable[Concatenate["Backdoor", P], T],
) -> Callable[Concatenate["Backdoor", P], T]:
    """Decorator: the method changes something; it runs between two ticks, and listeners are told of it."""
    name = method.__name__

    @wraps(method)
    def act(self: "Backdoor", /, *args: P.args, **kwargs: P.kwargs) -> T:
        given = [*map(repr, args), *(f"{key}={value!r}" for key, value in kwargs.items())]
        text = harmless(shortened(f"{name}({', '.join(given)})", LONGEST_TEXT))
        try:
            done = method(self, *args, **kwargs)
        except Refused as refused:
            self._note(text, f"{refused.code} {refused.reason}")
            raise
        for listener in self.listeners:
            listener(text)
        now_s = time.monotonic()
        if name not in DRAGGED or now_s >= self._dragged_until_s.get(name, now_s):
            self._dragged_until_s[name] = now_s + DRAGGED_S
            self._note(text)
        return done

    return called(act)


class Backdoor:
    """The backdoor of one simulator.

    Each method takes effect before the next tick, or raises `Refused(code, reason)` and changes nothing.
    Frames are in mm and rad. `connection` is a number of `connections()`, `EVERY` or `NEXT`; `replies` is the
    number of replies concerned, 0 for all until `clear_faults`.
    """

    def __init__(
        self,
        controller: Controller,
        wire: WireFaults,
        ports: Callable[[], Sequence[Acceptor]],
        clock: Clock,
        dialogue: Dialogue,
        call: Call = lambda function: function(),
        group: ControllerGroup | None = None,
        states: States | None = None,
    ) -> None:
        """`ports` gives the listening ports of all protocols; `group` and `states` are those of the cell."""
        self.call = call
        self.listeners: list[Callable[[str], None]] = []
        """Called with the text of each call that has changed something."""
        self._controller = controller
        self._wire = wire
        self._ports = ports
        self._clock = clock
        self._camera = Camera(controller)
        self._dialogue = dialogue
        self._group = group or ControllerGroup({controller: IDENTITY})
        self._states = states or States(controller)
        self._client = HERE
        self._dragged_until_s: dict[str, float] = {}

    @contextmanager
    def _by(self, client: str) -> Iterator[None]:
        """Name a client in the dialogue as the one that acts meanwhile."""
        self._client = client
        try:
            yield
        finally:
            self._client = HERE

    def _note(self, text: str, reason: str = "") -> None:
        self._dialogue.event(self._client, text, reason=reason)

    # Time

    async def advance(self, seconds: float) -> None:
        """Let so many seconds of simulated time pass (0 to a day), as fast as possible.

        To be awaited in the simulator's event loop; `Simulator.advance` is for other threads.
        """
        try:
            await self._clock.advance(seconds)
        except ValueError as fault:
            raise Refused(EXECUTION, str(fault)) from None

    async def run_until_stopped(self, limit_s: float) -> float:
        """Let time pass until the robot has stopped; return the seconds that took. Refused beyond `limit_s`.

        To be awaited like `advance`.
        """
        try:
            return await self._clock.run_until_stopped(limit_s)
        except (ValueError, StillMoving) as fault:
            raise Refused(EXECUTION, str(fault)) from None

    @acts
    def pause(self) -> None:
        """Suspend simulated time, except for `advance` and `run_until_stopped`."""
        self._clock.pause()

    @acts
    def resume(self) -> None:
        """Resume simulated time."""
        self._clock.resume()

    @acts
    def set_clock(self, name: str) -> None:
        """Set the pace of time: real, 10x or another multiple, fast, stepped. A pause goes on."""
        try:
            self._clock.set_pace(pace(name))
        except ValueError as fault:
            raise Refused(EXECUTION, str(fault)) from None

    @called
    def get_clock(self) -> str:
        """Return the pace of time, followed by `paused` if it is paused."""
        return self._clock.told

    # Pushes and surfaces

    @acts
    def push(self, wrench: Wrench) -> None:
        """Push at the TCP with N and Nm along its axes, until the next push or release."""
        _check_finite(wrench)
        self._controller.load.wrench = wrench if any(wrench) else NO_WRENCH

    @acts
    def push_joints(self, torques: Sequence[float]) -> None:
        """Push each joint with a torque (Nm), until the next push of this kind or release."""
        _check_finite(torques)
        if len(torques) != len(self._controller.description.joints):
            raise Refused(EXECUTION, f"{len(self._controller.description.joints)} torques are needed")
        self._controller.load.joint_push = tuple(torques)

    @acts
    def release(self) -> None:
        """End both kinds of push."""
        self._controller.load.wrench = NO_WRENCH
        self._controller.load.joint_push = (0.0,) * len(self._controller.description.joints)

    @acts
    def add_surface(self, surface: AnySurface) -> None:
        """Add a surface with the keys of cell.toml. Refused where the TCP would be within it."""
        surfaces.add(self._group, self._controller, surface)

    @acts
    def move_surface(self, name: str, pose: Frame) -> None:
        """Move a surface to a pose in the base, at once. One that touches the TCP goes on pushing it."""
        _check_pose(pose)
        surfaces.move(self._group, self._controller, name, pose)

    @acts
    def remove_surface(self, name: str) -> None:
        """Remove a surface."""
        surfaces.remove(self._group, self._controller, name)

    @called
    def surfaces(self) -> list[str]:
        """Return the names of all surfaces."""
        return list(self._controller.load.world.surfaces)

    @called
    def cell(self) -> DescribedCell:
        """Return surfaces, shapes of parts, tool and jaws, and names of inputs and outputs."""
        return described_cell(self._controller)

    @acts
    def set_tool(self, tool_in_flange: Frame) -> None:
        """Set the pose of the TCP in the flange (mm, rad). At rest only."""
        _check_pose(tool_in_flange)
        controller, tool = self._controller, tool_in_flange.to_transform()
        tcp = compose(controller.flange_frame().to_transform(), tool)
        surfaces.check_outside(controller, tcp=tcp.translation)
        controller.set_tool(tool)

    @called
    def tool(self) -> Frame:
        """Return the pose of the TCP in the flange."""
        return Frame.from_transform(self._controller.tool_in_flange)

    # Inputs and outputs

    @acts
    def set_input(self, number: int, on: bool) -> None:
        """Switch a digital input, numbered from 1."""
        self._controller.io.wire(number, on)

    @called
    def input(self, number: int) -> bool:
        """Return a digital input, numbered from 1."""
        return self._controller.io.input(number)

    @called
    def output(self, number: int) -> bool:
        """Return a digital output, numbered from 1."""
        return self._controller.io.output(number)

    @called
    def inputs(self) -> tuple[bool, ...]:
        """Return all digital inputs, from number 1 on."""
        return self._controller.io.inputs

    @called
    def outputs(self) -> tuple[bool, ...]:
        """Return all digital outputs, from number 1 on."""
        return self._controller.io.outputs

    # The robot

    @acts
    def emergency_stop(self) -> None:
        """Press the emergency stop: the robot stops with error 3030."""
        self._controller.emergency_stop()

    @acts
    def release_emergency_stop(self) -> None:
        """Release the emergency stop. Reset the error, too."""
        self._controller.release_emergency_stop()

    @acts
    def protective_stop(self) -> None:
        """Stop the robot with error 3060."""
        self._controller.fail(STOP_TRIGGERED, PROTECTIVE_STOP)

    @acts
    def switch_drives(self, on: bool) -> None:
        """Switch the drives. Off stops the robot with error 3010, which can be reset when they are on."""
        self._controller.switch_drives(on)

    @acts
    def reset_error(self) -> None:
        """End the error state. Refused while the emergency stop is pressed or the drives are off."""
        self._controller.reset_error()

    @acts
    def set_override(self, override: float) -> None:
        """Set the override, 0 to 1, also for a running move."""
        self._controller.set_override(override)

    @called
    def override(self) -> float:
        """Return the override, 0 to 1."""
        return self._controller.override

    @acts
    def place(self, joints: Sequence[float]) -> None:
        """Put the robot at joint positions (rad) without a motion. At rest only."""
        controller = self._controller
        controller.check_place(joints)
        tcp = controller.tcp(tuple(joints))
        surfaces.check_outside(controller, tcp=tcp.translation)
        controller.place(joints)

    @called
    def robot(self) -> DescribedRobot:
        """Return the arm: its name, joints, limits (rad, rad/s), flange and URDF."""
        return described_robot(self._controller)

    @called
    def state(self) -> Snapshot:
        """Return the state of the robot, as on the status port."""
        return snapshot(self._controller)

    @called
    def moves(self) -> DescribedMoves:
        """Return how many moves run and wait, and the targets of the first 50."""
        return described_moves(self._controller, MOST_MOVES)

    async def camera(self, name: str, width: int = WIDTH, height: int = HEIGHT) -> bytes:
        """Return what a camera of the scene sees, as PNG of so many pixels.

        To be awaited like `advance`; `Simulator.camera` is for other threads. Over HTTP the name stands in
        the path: GET /camera/NAME.
        """
        return await wrap_future(self._camera.picture(name, width, height))

    @acts
    def save_state(self, name: str) -> None:
        """Save joints, tool, load, gripper, parts, override, IO, pushes and surfaces. At rest only.

        A state is one of the whole cell, with all its robots.
        """
        self._states.save(name)

    @acts
    def restore_state(self, name: str) -> None:
        """Restore a saved state, or `start`, and end any error. At rest only."""
        self._states.restore(name)

    @called
    def states(self) -> list[str]:
        """Return the names of all saved states."""
        return self._states.names

    # What was said

    @called
    def dialogue(self, since: int = 0) -> RecentLines:
        """Return the lines said in all protocols from number `since` on, the newest 200.

        They are kept from the start where the backdoor has a port, otherwise from the first call on.
        """
        self._dialogue.remember()
        return self._dialogue.since(since)

    # Random numbers

    @acts
    def seed(self, seed: int) -> None:
        """Restart the random numbers of noise and garbled replies, from a seed of 0 to 2**32 - 1."""
        if not 0 <= seed < 2**32:
            raise Refused(EXECUTION, f"seed {seed}: expected 0 to {2**32 - 1}")
        if self._controller.load.noise is not None:
            self._controller.load.noise.seed(seed)
        self._wire.seed(seed)

    # Robot faults

    @acts
    def refuse_next_move(self, code: int) -> None:
        """Refuse the next move with this code. It is no error state."""
        self._controller.errors.next_refusal = ErrorRecord(_checked(code), ON_PURPOSE)

    @acts
    def fail_move(self, code: int) -> None:
        """Make the running move fail: the robot stops on its path with this code."""
        if not self._controller.moving:
            raise Refused(EXECUTION, "nothing moves that could fail")
        self._controller.fail(_checked(code), ON_PURPOSE)

    @acts
    def time_out_servo(self) -> None:
        """End smart or direct mode as a servo timeout does, with error 3040."""
        self._controller.time_out_servo()

    @acts
    def following_error(self, joint: int) -> None:
        """Stop the robot as if a joint (from 1) had a following error, with error 3000."""
        names = self._controller.description.joints
        if not 1 <= joint <= len(names):
            raise Refused(EXECUTION, f"no joint {joint}: there are 1 to {len(names)}")
        self._controller.fail(EXECUTION, f"following error of {names[joint - 1]}: the robot stops")

    # The gripper

    @acts
    def stick_jaws(self, stuck: bool) -> None:
        """Make the jaws of the gripper stay where they are, or follow their outputs again."""
        self._handling.stick(stuck)

    @acts
    def wrong_sensor(self, sensor: str, on: bool) -> None:
        """Fix the sensor `open`, `closed` or `holds` of the gripper at a value."""
        self._handling.mistake(sensor, on)

    @acts
    def lose_part(self) -> None:
        """Let the part fall that the gripper holds."""
        self._handling.lose()

    @acts
    def remove_part(self, name: str) -> None:
        """Remove a part."""
        self._handling.remove(name)

    @acts
    def repair_gripper(self) -> None:
        """End stuck jaws and wrong sensors."""
        self._handling.repair()

    @property
    def _handling(self) -> Handling:
        handling = self._controller.handling
        if handling is None:
            raise Refused(EXECUTION, "the cell has no gripper")
        return handling

    # Replies

    @acts
    def reply(self, command: str, reply: str, times: int = 1) -> None:
        """Answer the next `times` lines of a command by `reply` without executing them; 0 for all.

        It lasts until `clear_faults`. The reply is one line of printable ASCII.
        """
        try:
            self._wire.canned.set(command, reply, times)
        except ValueError as fault:
            raise Refused(EXECUTION, str(fault)) from None

    # Wire faults

    @called
    def connections(self) -> dict[int, str]:
        """Return the connections of drivers: number and HOST:PORT."""
        return self._wire.connections()

    @acts
    def set_fault(self, fault: Fault, connection: int = EVERY, replies: int = UNTIL_CLEARED) -> None:
        """Apply a fault to the next `replies` replies of a connection, after faults set before."""
        if not isinstance(fault, Fault):
            shown = fault.__name__ if isinstance(fault, type) else repr(fault)
            kinds = ", ".join(
                f"{kind.__name__}({', '.join(kind.__struct_fields__)})" for kind in get_args(Fault)
            )
            raise Refused(EXECUTION, f"fault {harmless(shortened(shown, 40))}: expected one of {kinds}")
        if replies < 0:
            raise Refused(EXECUTION, f"{replies} replies: expected 0 or more")
        for key, value in msgspec.structs.asdict(fault).items():
            low, high = (1, float("inf")) if key == "byte" else (0.0, LONGEST_WAIT_S)
            if not low <= value <= high:
                raise Refused(EXECUTION, "{} {}: expected {} to {}".format(key, *distinct(value, low, high)))
        self._wire.set(fault, connection, replies)

    @acts
    def stop_answering(self, connection: int = EVERY) -> None:
        """Neither answer nor execute lines until `clear_faults`, and then all of them."""
        self._wire.set(Silence(), connection)

    @acts
    def close_connections(self, connection: int = EVERY) -> None:
        """Close one connection, or all (FIN)."""
        self._wire.end(Close(), connection)
        if connection == EVERY:
            for each in self._ports():
                each.drop_arriving(reset=False)

    @acts
    def reset_connections(self, connection: int = EVERY) -> None:
        """Reset one connection, or all (RST)."""
        self._wire.end(Reset(), connection)
        if connection == EVERY:
            for each in self._ports():
                each.drop_arriving(reset=True)

    @acts
    def refuse_connections(self) -> None:
        """Refuse new connections of drivers; those there are served."""
        for each in self._ports():
            each.refuse()

    @acts
    def accept_connections(self) -> None:
        """Accept connections again."""
        for each in self._ports():
            each.accept()

    @acts
    def clear_faults(self) -> None:
        """End faults of the wire and of the next move, and canned replies; accept connections."""
        self._controller.errors.next_refusal = None
        self._wire.clear()
        for each in self._ports():
            each.accept()


def _check_finite(values: Sequence[float]) -> None:
    if not all(map(isfinite, values)):
        raise Refused(EXECUTION, "expected finite numbers")


def _check_pose(pose: Frame) -> None:
    try:
        Reader("pose", CellFault).converted(pose._asdict(), ToolSettings)
    except CellFault as fault:
        raise Refused(EXECUTION, str(fault)) from None


def _checked(code: int) -> int:
    if not 1 <= code < 2**31:
        raise Refused(EXECUTION, f"code {code}: expected 1 to {2**31 - 1}")
    return code
