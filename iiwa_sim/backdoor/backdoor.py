"""The backdoor: what a test bench does to robot, cell, time and wire. docs/backdoor.md has it as a table."""

from collections.abc import Callable, Sequence
from functools import wraps
from math import isfinite
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from iiwa_sim.backdoor import surfaces
from iiwa_sim.backdoor.outside import Entrance
from iiwa_sim.backdoor.states import States
from iiwa_sim.cell.settings import POSE_RANGES, AnySurface
from iiwa_sim.clock.clock import Clock, StillMoving
from iiwa_sim.clock.pace import pace
from iiwa_sim.contact.wrench import NO_WRENCH, Wrench
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import (
    EXECUTION,
    STOP_TRIGGERED,
    ErrorRecord,
    Refused,
)
from iiwa_sim.controller.snapshot import Snapshot, snapshot
from iiwa_sim.dialect.faults import (
    EVERY,
    LONGEST_WAIT_S,
    UNTIL_CLEARED,
    Close,
    Fault,
    Reset,
    Silence,
    WireFaults,
)
from iiwa_sim.frames import Frame, compose

ON_PURPOSE = "made to fail through the backdoor"
PROTECTIVE_STOP = "protective stop"

P = ParamSpec("P")
T = TypeVar("T")


class Call(Protocol):
    """Calls a function where the robot lives, and gives what that gives, or raises."""

    def __call__(self, function: Callable[[], T]) -> T: ...


def _at_once(function: Callable[[], T]) -> T:
    return function()


def _called(
    method: Callable[Concatenate["Backdoor", P], T],
) -> Callable[Concatenate["Backdoor", P], T]:
    """Where the robot lives in a thread of its own, it is called there, between two ticks."""

    @wraps(method)
    def call(self: "Backdoor", /, *args: P.args, **kwargs: P.kwargs) -> T:
        return self.call(lambda: method(self, *args, **kwargs))

    return call


class Backdoor:
    """One simulator's backdoor.

    Each method takes effect before the next tick, or raises `Refused(code, reason)` and changes nothing.
    Frames are in mm and rad. `connection` is a number of `connections()`, `EVERY` or `NEXT`; `replies` is how
    many it befalls, 0 for all until `clear_faults`.
    """

    def __init__(
        self,
        controller: Controller,
        wire: WireFaults,
        entrance: Entrance,
        clock: Clock,
        call: Call = _at_once,
    ) -> None:
        self.call = call
        self._controller = controller
        self._wire = wire
        self._entrance = entrance
        self._clock = clock
        self._states = States(controller)

    @property
    def joint_count(self) -> int:
        """How many joints the robot has."""
        return len(self._controller.description.joints)

    # Time

    async def advance(self, seconds: float) -> None:
        """Make the ticks of so much simulated time (0 to a day), as fast as the machine can.

        To be awaited where the robot lives; `Simulator.advance` is for other threads.
        """
        try:
            await self._clock.advance(seconds)
        except ValueError as fault:
            raise Refused(EXECUTION, str(fault)) from None

    async def run_until_stopped(self, limit_s: float) -> float:
        """Make ticks until the robot has stopped; gives the simulated seconds that took.

        Refused where it still moves after `limit_s` (0 to a day), too; those ticks are made. To be awaited
        like `advance`.
        """
        try:
            return await self._clock.run_until_stopped(limit_s)
        except (ValueError, StillMoving) as fault:
            raise Refused(EXECUTION, str(fault)) from None

    @_called
    def pause(self) -> None:
        """Let time stand still, but for `advance` and `run_until_stopped`."""
        self._clock.pause()

    @_called
    def resume(self) -> None:
        """Let time pass again."""
        self._clock.resume()

    @_called
    def set_clock(self, name: str) -> None:
        """Let time pass otherwise: real, 10x or another multiple, fast, stepped. A pause goes on."""
        try:
            self._clock.set_pace(pace(name))
        except ValueError as fault:
            raise Refused(EXECUTION, str(fault)) from None

    @_called
    def get_clock(self) -> str:
        """How time passes, with `paused` behind it where it is."""
        return f"{self._clock.pace.name}{' paused' if self._clock.paused else ''}"

    # What pushes the robot, and what it touches

    @_called
    def push(self, wrench: Wrench) -> None:
        """Push at the TCP, along its axes (N, Nm), in place of the push before."""
        _check_finite(wrench)
        self._controller.load.wrench = wrench if any(wrench) else NO_WRENCH

    @_called
    def push_joints(self, torques: Sequence[float]) -> None:
        """Push the joints (Nm each), in place of the push before."""
        _check_finite(torques)
        if len(torques) != self.joint_count:
            raise Refused(EXECUTION, f"{self.joint_count} torques are needed")
        self._controller.load.joint_push = tuple(torques)

    @_called
    def release(self) -> None:
        """End both kinds of push."""
        self._controller.load.wrench = NO_WRENCH
        self._controller.load.joint_push = (0.0,) * self.joint_count

    @_called
    def add_surface(self, settings: AnySurface) -> None:
        """Have a surface more: the settings are those of cell.toml. It is felt from the next tick on.

        Refused where the TCP would be within it, for numbers out of range, and for a name already taken.
        """
        surfaces.add(self._controller, settings)

    @_called
    def move_surface(self, name: str, pose: Frame) -> None:
        """Have a surface elsewhere in the base. Refused where the TCP would be within it."""
        _check_pose(pose)
        surfaces.move(self._controller, name, pose)

    @_called
    def remove_surface(self, name: str) -> None:
        """Have a surface no more."""
        surfaces.remove(self._controller, name)

    @_called
    def surfaces(self) -> list[str]:
        """The names of all of them."""
        return list(self._controller.load.world.surfaces)

    @_called
    def set_tool(self, tool_in_flange: Frame) -> None:
        """Have the TCP elsewhere in the flange.

        Refused while anything moves or waits, and where the TCP would be within a surface.
        """
        _check_pose(tool_in_flange)
        controller, tool = self._controller, tool_in_flange.to_transform()
        tcp = compose(controller.flange_frame().to_transform(), tool)
        surfaces.check_outside(list(controller.load.world.surfaces.values()), tcp.translation)
        controller.set_tool(tool)

    @_called
    def tool(self) -> Frame:
        """The TCP in the flange."""
        return Frame.from_transform(self._controller.tool_in_flange)

    # What is wired to the controller

    @_called
    def set_input(self, number: int, on: bool) -> None:
        """Switch a digital input, numbered from 1."""
        self._controller.io.wire(number, on)

    @_called
    def input(self, number: int) -> bool:
        """The state of a digital input, numbered from 1."""
        return self._controller.io.input(number)

    @_called
    def output(self, number: int) -> bool:
        """The state of a digital output, numbered from 1."""
        return self._controller.io.output(number)

    @_called
    def inputs(self) -> tuple[bool, ...]:
        """The states of all digital inputs, from number 1 on."""
        return self._controller.io.inputs

    @_called
    def outputs(self) -> tuple[bool, ...]:
        """The states of all digital outputs, from number 1 on."""
        return self._controller.io.outputs

    # The robot

    @_called
    def emergency_stop(self) -> None:
        """Press the emergency stop."""
        self._controller.emergency_stop()

    @_called
    def release_emergency_stop(self) -> None:
        """Release it; the error has to be reset besides."""
        self._controller.release_emergency_stop()

    @_called
    def protective_stop(self) -> None:
        """Stop the robot with an error, to be reset."""
        self._controller.fail(STOP_TRIGGERED, PROTECTIVE_STOP)

    @_called
    def switch_drives(self, on: bool) -> None:
        """Off: the robot stops with an error, which can be reset when they are on again."""
        self._controller.switch_drives(on)

    @_called
    def reset_error(self) -> None:
        """End the state of error. Refused while the emergency stop is pressed or the drives are off."""
        self._controller.reset_error()

    @_called
    def set_override(self, override: float) -> None:
        """Have all motion run at this part of its speed, 0 to 1, also what is under way."""
        self._controller.set_override(override)

    @_called
    def override(self) -> float:
        """The rate at which all motion runs, 0 to 1."""
        return self._controller.override

    @_called
    def place(self, joints: Sequence[float]) -> None:
        """Have the robot at joint positions (rad), without a way there.

        Refused while anything moves or waits, outside the limits, and with the TCP within a surface.
        """
        controller = self._controller
        controller.check_place(joints)
        tcp = controller.tcp(tuple(joints))
        surfaces.check_outside(list(controller.load.world.surfaces.values()), tcp.translation)
        controller.place(joints)

    @_called
    def state(self) -> Snapshot:
        """The whole state of the robot."""
        return snapshot(self._controller)

    @_called
    def save_state(self, name: str) -> None:
        """Keep the state of the cell. Refused while the robot moves."""
        self._states.save(name)

    @_called
    def restore_state(self, name: str) -> None:
        """Bring back a state of the cell; `start` is the first one. Refused while the robot moves."""
        self._states.restore(name)

    @_called
    def states(self) -> list[str]:
        """The names of all states that can be restored."""
        return self._states.names

    @_called
    def seed(self, seed: int) -> None:
        """Begin all random numbers anew: those of noise, and of garbled replies. 0 to 2**32 - 1."""
        if not 0 <= seed < 2**32:
            raise Refused(EXECUTION, f"seed {seed}: expected 0 to {2**32 - 1}")
        self._controller.load.seed(seed)
        self._wire.seed(seed)

    # Faults of the robot

    @_called
    def refuse_next_move(self, code: int) -> None:
        """Have the next move outside of the state of error refused, whatever it asks for."""
        self._controller.refuse_next_move(ErrorRecord(_checked(code), ON_PURPOSE))

    @_called
    def fail_move(self, code: int) -> None:
        """Have what moves fail: the robot stops on its path with an error. Refused where nothing moves."""
        if not self._controller.moving:
            raise Refused(EXECUTION, "nothing moves that could fail")
        self._controller.fail(_checked(code), ON_PURPOSE)

    @_called
    def time_out_servo(self) -> None:
        """End a smart or direct mode as a servo timeout does. Refused in other modes."""
        self._controller.time_out_servo()

    @_called
    def following_error(self, joint: int) -> None:
        """Stop the robot as if a joint, numbered from 1, were not where it should be."""
        names = self._controller.description.joints
        if not 1 <= joint <= len(names):
            raise Refused(EXECUTION, f"no joint {joint}: there are 1 to {len(names)}")
        self._controller.fail(EXECUTION, f"following error of {names[joint - 1]}: the robot stops")

    # Faults on the wire

    @_called
    def connections(self) -> dict[int, str]:
        """Who is connected to the main port, by number."""
        return self._wire.connections()

    @_called
    def set_fault(self, fault: Fault, connection: int = EVERY, replies: int = UNTIL_CLEARED) -> None:
        """Have one of `iiwa_sim.dialect.faults` befall replies, behind those set before."""
        if replies < 0:
            raise Refused(EXECUTION, f"{replies} replies: expected 0 or more")
        for key, value in getattr(fault, "_asdict", dict)().items():
            low, high = (1, float("inf")) if key == "byte" else (0.0, LONGEST_WAIT_S)
            if not low <= value <= high:
                raise Refused(EXECUTION, f"{key} {value:g}: expected {low:g} to {high:g}")
        self._wire.set(fault, connection, replies)

    @_called
    def stop_answering(self, connection: int = EVERY) -> None:
        """Leave lines unanswered, and not carried out, until `clear_faults`."""
        self._wire.set(Silence(), connection)

    @_called
    def close_connections(self, connection: int = EVERY) -> None:
        """Close one, or all there are, now."""
        self._wire.end(Close(), connection)

    @_called
    def reset_connections(self, connection: int = EVERY) -> None:
        """Reset one, or all there are, now."""
        self._wire.end(Reset(), connection)

    @_called
    def refuse_connections(self) -> None:
        """Let nobody connect to the port of any dialect. Who is connected is served."""
        self._entrance.refuse()

    @_called
    def accept_connections(self) -> None:
        """Let clients connect again."""
        self._entrance.accept()

    @_called
    def clear_faults(self) -> None:
        """Take back all faults that are set, of the wire and of the next move, and accept connections."""
        self._controller.refuse_next_move(None)
        self._wire.clear()
        self._entrance.accept()


def _checked(code: int) -> int:
    if not 1 <= code < 2**31:
        raise Refused(EXECUTION, f"code {code}: expected 1 to {2**31 - 1}")
    return code


def _check_finite(values: Sequence[float]) -> None:
    if not all(map(isfinite, values)):
        raise Refused(EXECUTION, "expected finite numbers")


def _check_pose(pose: Frame) -> None:
    for (key, (low, high, unit)), value in zip(POSE_RANGES.items(), pose, strict=True):
        if not low <= value <= high:
            raise Refused(EXECUTION, f"{key} {value:g}: expected {low:g} to {high:g}{unit}")
