"""The backdoor: calls of a test bench on robot, cell, time and wire.

The first paragraphs of the docstrings are the table of docs/backdoor.md and of `GET /`.
"""

from collections.abc import Sequence
from math import isfinite

from iiwa_sim.backdoor import surfaces
from iiwa_sim.backdoor.base import acts, called
from iiwa_sim.backdoor.described import (
    DescribedCell,
    DescribedMoves,
    DescribedRobot,
    described_cell,
    described_moves,
    described_robot,
)
from iiwa_sim.backdoor.faults import Faults
from iiwa_sim.cell.placed import POSE_RANGES
from iiwa_sim.cell.surfaces import AnySurface
from iiwa_sim.clock.clock import StillMoving
from iiwa_sim.clock.pace import pace
from iiwa_sim.controller.errors import EXECUTION, STOP_TRIGGERED, Refused
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.dialogue import RecentLines
from iiwa_sim.frames import Frame, compose
from iiwa_sim.wrench import NO_WRENCH, Wrench

PROTECTIVE_STOP = "protective stop"
MOST_MOVES = 50
"""Moves that `moves` tells at most, of those that run and wait."""


class Backdoor(Faults):
    """The backdoor of one simulator.

    Each method takes effect before the next tick, or raises `Refused(code, reason)` and changes nothing.
    Frames are in mm and rad. Failures on purpose are in `faults.py`.
    """

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
        if len(torques) != self.joint_count:
            raise Refused(EXECUTION, f"{self.joint_count} torques are needed")
        self._controller.load.joint_push = tuple(torques)

    @acts
    def release(self) -> None:
        """End both kinds of push."""
        self._controller.load.wrench = NO_WRENCH
        self._controller.load.joint_push = (0.0,) * self.joint_count

    @acts
    def add_surface(self, surface: AnySurface) -> None:
        """Add a surface with the keys of cell.toml. Refused where the TCP or a part would be within it."""
        surfaces.add(self._controller, surface)

    @acts
    def move_surface(self, name: str, pose: Frame) -> None:
        """Move a surface to a pose in the base, at once. One that touches the TCP goes on pushing it."""
        _check_pose(pose)
        surfaces.move(self._controller, name, pose)

    @acts
    def remove_surface(self, name: str) -> None:
        """Remove a surface."""
        surfaces.remove(self._controller, name)

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
        surfaces.check_outside(list(controller.load.world.surfaces.values()), tcp.translation)
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
        surfaces.check_outside(list(controller.load.world.surfaces.values()), tcp.translation)
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

    @acts
    def save_state(self, name: str) -> None:
        """Save joints, tool, load, gripper, parts, override, IO, pushes and surfaces. At rest only."""
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
        self._controller.load.seed(seed)
        self._wire.seed(seed)


def _check_finite(values: Sequence[float]) -> None:
    if not all(map(isfinite, values)):
        raise Refused(EXECUTION, "expected finite numbers")


def _check_pose(pose: Frame) -> None:
    for (key, (low, high, unit)), value in zip(POSE_RANGES.items(), pose, strict=True):
        if not low <= value <= high:
            raise Refused(EXECUTION, f"{key} {value:g}: expected {low:g} to {high:g}{unit}")
