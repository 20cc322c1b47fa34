"""The backdoor: calls of a test on robot, cell, time and wire.

The first paragraphs of the docstrings are the table of docs/backdoor.md and of `GET /`.
"""

import time
from asyncio import wrap_future
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import wraps
from inspect import iscoroutinefunction, signature
from typing import Any, get_type_hints

import msgspec

from iiwa_sim.backdoor.described import described_cell, parts_of
from iiwa_sim.camera import HEIGHT, WIDTH, Camera
from iiwa_sim.cell.bodies import AnySurface, surface_of
from iiwa_sim.cell.settings import CellFault
from iiwa_sim.clock.clock import Clock, StillMoving
from iiwa_sim.clock.pace import pace
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.controller.errors import EXECUTION, ErrorRecord, Refused
from iiwa_sim.controller.handling import Handling
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.dialogue import Dialogue, RecentLines
from iiwa_sim.frames import Frame, Vector, compose, inverse
from iiwa_sim.log import Throttle
from iiwa_sim.protocols.faults import EVERY, UNTIL_CLEARED, End, Fault, WireFaults
from iiwa_sim.robot.description import RobotDescription, ToolSettings
from iiwa_sim.server.tcp import TcpServer
from iiwa_sim.settings import LONGEST_NAME, Reader
from iiwa_sim.wording import harmless, shortened
from iiwa_sim.wrench import NO_WRENCH, Wrench

__tracebackhide__ = True  # pytest shows the line of the test instead
ON_PURPOSE = "made to fail through the backdoor"
LONGEST_TEXT = 200
"""Characters of a call in the dialogue, and of a reason."""
BACKDOOR = "backdoor"
"""Name of all its clients in the dialogue."""
FAULTS = (ValueError, CellFault, StillMoving, msgspec.ValidationError)
"""Faults of values, which a call raises as `Refused`, with their message as the reason."""


class Backdoor:
    """The backdoor of one simulator.

    Each method takes effect before the next tick, or raises `Refused(code, reason)` and changes nothing.
    Frames are in mm and rad. `connection` is a number of `connections()`, `EVERY` or `NEXT`; `replies` is the
    number of replies concerned, 0 for all until `clear_faults`.

    Coroutines are awaited in the simulator's event loop; `Simulator` has methods for other threads.
    """

    def __init__(
        self,
        controller: Controller,
        wire: WireFaults,
        ports: Collection[TcpServer],
        clock: Clock,
        dialogue: Dialogue,
        call: Callable[[Callable[[], Any]], Any] = lambda function: function(),
        group: ControllerGroup | None = None,
        states: dict[str, list[Callable[[], None]]] | None = None,
    ) -> None:
        """`ports` are those of all protocols; `group` and `states`, empty at first, are those of the cell.

        `call` calls a function in the simulator's event loop and returns its result, or raises its fault.
        """
        self._call = call
        self._controller = controller
        self._wire = wire
        self._ports = ports
        self._clock = clock
        self._camera = Camera(controller)
        self._dialogue = dialogue
        self._group = group or ControllerGroup([controller])
        self._states = {} if states is None else states
        """Functions that restore a state of each robot, by the names of states."""
        self._states.setdefault("start", list(map(_kept, self._group.controllers)))
        self._pushes = Throttle(1)  # of the page, while a viewer drags the arm

    # Time

    async def advance(self, seconds: float) -> None:
        """Let so many seconds of simulated time pass (0 to a day), as fast as possible."""
        try:
            await self._clock.advance(seconds)
        except FAULTS as fault:
            raise Refused(EXECUTION, str(fault)) from None

    async def run_until_stopped(self, limit_s: float) -> float:
        """Let time pass until the robot has stopped; return the seconds taken. Rejected beyond `limit_s`."""
        try:
            return await self._clock.run_until_stopped(limit_s)
        except FAULTS as fault:
            raise Refused(EXECUTION, str(fault)) from None

    def pause(self, paused: bool = True) -> None:
        """Suspend simulated time, except for `advance` and `run_until_stopped`, or resume it."""
        (self._clock.pause if paused else self._clock.resume)()

    def set_clock(self, name: str) -> None:
        """Set the pace of time: real, 10x or another multiple, fast, stepped. A pause continues."""
        self._clock.set_pace(pace(name))

    def get_clock(self) -> str:
        """Return the pace of time, followed by `paused` if it is paused."""
        return self._clock.label

    # Pushes and surfaces

    def push(self, wrench: Wrench) -> None:
        """Push at the TCP with N and Nm along its axes, until the next push or release."""
        self._controller.load.wrench = wrench

    def push_joints(self, torques: Sequence[float]) -> None:
        """Push each joint with a torque (Nm), until the next push of this kind or release."""
        self._controller.load.joint_push = tuple(torques)

    def release(self) -> None:
        """End both kinds of push."""
        self._controller.load.wrench = NO_WRENCH
        self._controller.load.joint_push = (0.0,) * len(self._controller.description.joints)

    def add_surface(self, surface: AnySurface) -> None:
        """Add a surface with the keys of cell.toml, in JSON with `shape`. The TCP may not be within it."""
        taken = {*self._controller.load.contact.surfaces, *(part.name for part in parts_of(self._controller))}
        reader = Reader("surface", CellFault)
        reader.converted(msgspec.to_builtins(surface), type(surface))
        reader.check("name", surface.name, surface.name not in taken, "a name no surface and no part has")
        self._put(surface_of(surface))

    def move_surface(self, name: str, pose: Frame) -> None:
        """Move a surface to a pose in the base, at once. One that touches the TCP still pushes it."""
        _check_pose(pose)
        self._put(self._surface(name)._replace(pose=pose.to_transform()))

    def remove_surface(self, name: str) -> None:
        """Remove a surface."""
        self._surface(name)
        for controller in self._group.controllers:
            controller.load.contact.remove(name)

    def _surface(self, name: str) -> Surface:
        surfaces = self._controller.load.contact.surfaces
        if name not in surfaces:
            there_are = ", ".join(map(repr, surfaces)) or "none"
            raise Refused(EXECUTION, harmless(f"no surface {name!r}: there are {there_are}"))
        return surfaces[name]

    def _put(self, surface: Surface) -> None:
        """Add or move a surface, given in the base of this robot, for all robots of the cell."""
        in_world, robots = compose(self._controller.base, surface.pose), self._group.controllers
        seen = {each: surface._replace(pose=compose(inverse(each.base), in_world)) for each in robots}
        is_there = surface.name in self._controller.load.contact.surfaces
        for robot, each in seen.items():
            if not (is_there and robot.load.contact.touched(each.name)):
                _check_outside(robot.tcp().translation, [each])
        for robot, each in seen.items():
            if is_there:
                robot.load.contact.move(each.name, each.pose)
            else:
                robot.load.contact.put(each)

    def cell(self) -> dict[str, Any]:
        """Return surfaces, shapes of parts, tool and jaws, and names of inputs and outputs."""
        return described_cell(self._controller)

    def set_tool(self, tool_in_flange: Frame) -> None:
        """Set the pose of the TCP in the flange (mm, rad). At rest only."""
        _check_pose(tool_in_flange)
        controller, tool = self._controller, tool_in_flange.to_transform()
        tcp = compose(controller.flange_frame().to_transform(), tool)
        _check_outside(tcp.translation, controller.load.contact.surfaces.values())
        controller.place(controller.joints, tool)

    # The robot and its inputs

    def set_input(self, number: int, on: bool) -> None:
        """Switch a digital input, numbered from 1."""
        self._controller.io.wire(number, on)

    def emergency_stop(self, pressed: bool = True) -> None:
        """Press the emergency stop: the robot stops with error 3030. Or release it; the error stays."""
        self._controller.emergency_stop(pressed)

    def fail(self, code: int, reason: str = ON_PURPOSE) -> None:
        """Stop the robot with an error: 3060 for a protective stop, 3040 for a servo timeout."""
        self._controller.fail(_checked(code), harmless(shortened(reason, LONGEST_TEXT)))

    def switch_drives(self, on: bool) -> None:
        """Switch the drives. Off stops the robot with error 3010, which can be reset when they are on."""
        self._controller.switch_drives(on)

    def reset_error(self) -> None:
        """End the error state. Rejected while the emergency stop is pressed or the drives are off."""
        self._controller.errors.reset()

    def set_override(self, override: float) -> None:
        """Set the override, 0 to 1, also for a running move."""
        self._controller.set_override(override)

    def place(self, joints: Sequence[float]) -> None:
        """Put the robot at joint positions (rad) without a motion. At rest only."""
        controller = self._controller
        tcp = controller.tcp(controller.planner.checked_joints(joints))
        _check_outside(tcp.translation, controller.load.contact.surfaces.values())
        controller.place(joints)

    def robot(self) -> RobotDescription:
        """Return the arm: its name, joints, limits (rad, rad/s), flange and URDF."""
        return self._controller.description

    def state(self) -> Snapshot:
        """Return the state of the robot with inputs, outputs and override, as on the status port."""
        return snapshot(self._controller)

    def moves(self) -> int:
        """Return how many moves run and wait. The target of a servo is one, too."""
        return self._controller.motions.count

    async def camera(self, name: str, width: int = WIDTH, height: int = HEIGHT) -> bytes:
        """Return what a camera of the scene sees, as PNG of so many pixels."""
        return await wrap_future(self._camera.picture(name, width, height))

    def save_state(self, name: str) -> None:
        """Save joints, tool, load, gripper, parts, override, IO, pushes and surfaces. At rest only.

        A state is one of the whole cell, with all its robots.
        """
        self._check_rest()
        if name == "start" or not (name.strip() and name.isprintable() and len(name) <= LONGEST_NAME):
            reason = f"expected a name of up to {LONGEST_NAME} characters that print, other than start"
            raise Refused(EXECUTION, reason)
        self._states[name] = list(map(_kept, self._group.controllers))

    def restore_state(self, name: str) -> None:
        """Restore a saved state, or `start`, and end any error. At rest only."""
        if name not in self._states:
            there_are = ", ".join(map(repr, self._states))
            raise Refused(EXECUTION, harmless(f"no state {name!r}: there are {there_are}"))
        self._check_rest()
        for restore in self._states[name]:
            restore()

    def states(self) -> list[str]:
        """Return the names of all saved states."""
        return list(self._states)

    def _check_rest(self) -> None:
        if any(controller.moving for controller in self._group.controllers):
            raise Refused(EXECUTION, "all robots have to be at rest, with nothing waiting")

    def dialogue(self, since: int = 0) -> RecentLines:
        """Return the lines said in all protocols from number `since` on, of the newest 300 exchanges.

        They are kept from the start where the backdoor has a port, otherwise from the first call on.
        """
        self._dialogue.remember()
        return self._dialogue.since(since)

    def seed(self, seed: int) -> None:
        """Restart the random numbers of noise and garbled replies, from a seed of 0 to 2**32 - 1."""
        if not 0 <= seed < 2**32:
            raise Refused(EXECUTION, f"seed {seed}: expected 0 to {2**32 - 1}")
        if self._controller.load.noise is not None:
            self._controller.load.noise.seed(seed)
        self._wire.seed(seed)

    # Robot faults

    def refuse_next_move(self, code: int) -> None:
        """Reject the next move with this code, without an error state."""
        self._controller.errors.next_refusal = ErrorRecord(_checked(code), ON_PURPOSE)

    # The gripper

    def stick_jaws(self, stuck: bool) -> None:
        """Make the jaws of the gripper stay where they are, or follow their outputs again."""
        self._handling.stick(stuck)

    def wrong_sensor(self, sensor: str, on: bool) -> None:
        """Fix the sensor `open`, `closed` or `holds` of the gripper at a value."""
        self._handling.mistake(sensor, on)

    def lose_part(self) -> None:
        """Let the part fall that the gripper holds."""
        self._handling.lose()

    def remove_part(self, name: str) -> None:
        """Remove a part."""
        self._handling.remove(name)

    @property
    def _handling(self) -> Handling:
        handling = self._controller.handling
        if handling is None:
            raise Refused(EXECUTION, "the cell has no gripper, part or scene")
        return handling

    def reply(self, command: str, reply: str, times: int = 1) -> None:
        """Answer the next `times` lines of a command by `reply` without executing them; 0 for all.

        It lasts until `clear_faults`. The reply is one line of printable ASCII.
        """
        self._wire.canned.set(command, reply, times)

    # Wire faults

    def connections(self) -> dict[int, str]:
        """Return the connections of drivers: number and HOST:PORT."""
        return {number: name for number, (_, name) in self._wire.peers.items()}

    def set_fault(self, fault: Fault, connection: int = EVERY, replies: int = UNTIL_CLEARED) -> None:
        """Apply a fault to the next `replies` replies of a connection, after faults set before."""
        if replies < 0:
            raise Refused(EXECUTION, f"{replies} replies: expected 0 or more")
        msgspec.convert(msgspec.to_builtins(fault), Fault)  # checks the ranges
        self._wire.set(fault, connection, replies)

    def close_connections(self, connection: int = EVERY, reset: bool = False) -> None:
        """Close one connection, or all: by FIN, or by RST."""
        self._wire.end(End.RST if reset else End.FIN, connection)

    def refuse_connections(self, refused: bool = True) -> None:
        """Refuse new connections of drivers, or accept them again. Open connections stay."""
        for port in self._ports:
            (port.acceptor.refuse if refused else port.acceptor.accept)()

    def clear_faults(self) -> None:
        """End faults of wire, gripper and next move, and canned replies; accept connections."""
        self._controller.errors.next_refusal = None
        handling = self._controller.handling
        if handling is not None and handling.gripper is not None:
            handling.repair()
        self._wire.clear()
        for port in self._ports:
            port.acceptor.accept()


def _between_ticks(method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method that runs in the simulator's event loop, and reports its changes."""
    name, acts = method.__name__, method.__annotations__["return"] is None

    @wraps(method)
    def called(self: Backdoor, /, *args: Any, **kwargs: Any) -> Any:
        def act() -> Any:
            result = method(**_arguments(method, self, *args, **kwargs))
            if acts and (name != "push" or self._pushes.count(name, time.monotonic_ns())):
                given = ", ".join([*map(repr, args), *(f"{key}={each!r}" for key, each in kwargs.items())])
                self._dialogue.event(BACKDOOR, harmless(shortened(f"{name}({given})", LONGEST_TEXT)))
            return result

        try:
            return self._call(act)
        except FAULTS as fault:
            raise Refused(EXECUTION, str(fault)) from None

    return called


def _arguments(method: Callable[..., Any], *args: Any, **kwargs: Any) -> dict[str, Any]:
    """Return the arguments of a call by name, in the types of its parameters. Raises `Refused`."""
    given, types = signature(method).bind(*args, **kwargs).arguments, get_type_hints(method)
    for name, value in list(given.items())[1:]:
        try:
            given[name] = msgspec.convert(value.tolist() if hasattr(value, "tolist") else value, types[name])
        except msgspec.ValidationError as fault:
            raise Refused(EXECUTION, f"{method.__name__}: {name}: {fault}") from None
    return given


for _name, _method in list(vars(Backdoor).items()):
    if callable(_method) and not _name.startswith("_") and not iscoroutinefunction(_method):
        setattr(Backdoor, _name, _between_ticks(_method))


def _kept(controller: Controller) -> Callable[[], None]:
    """Return a function that restores the state of a robot, except time, errors and random numbers."""
    load, contact, io, handling = controller.load, controller.load.contact, controller.io, controller.handling
    joints, tool_in_flange, override = controller.joints, controller.tool_in_flange, controller.override
    inputs, outputs, surfaces = io.inputs, io.outputs, tuple(contact.surfaces.values())
    wrench, joint_push, tool_load = load.wrench, load.joint_push, controller.tool_load
    allowed = controller.protection.allowed
    restore_bodies = None if handling is None else handling.kept()
    contacts = load.kept()  # with their friction and entry sides

    def restore() -> None:
        for there in contact.surfaces:
            contact.remove(there)
        for surface in surfaces:
            contact.put(surface)
        controller.place(joints, tool_in_flange)
        controller.set_override(override)
        io.inputs, io.outputs = inputs, outputs
        load.wrench, load.joint_push = wrench, joint_push
        controller.set_tool_load(tool_load)
        if restore_bodies is not None:
            restore_bodies()
        load.restore(contacts)
        controller.emergency_stop(pressed=False)
        controller.switch_drives(on=True)
        controller.errors.reset()
        controller.protection.allowed = allowed

    return restore


def _check_outside(tcp: Vector, surfaces: Iterable[Surface]) -> None:
    """Raise `Refused` if the TCP (m, in the base) would be within a surface: the force would be unbounded."""
    for surface in surfaces:
        depth_mm = -1e3 * surface.nearest(*tcp)[0]
        if depth_mm > 0.0:
            reason = f"the TCP would be {depth_mm:.3f} mm within surface {surface.name!r}"
            raise Refused(EXECUTION, harmless(reason))


def _check_pose(pose: Frame) -> None:
    Reader("pose", CellFault).converted(pose._asdict(), ToolSettings)


def _checked(code: int) -> int:
    if not 1 <= code < 2**31:
        raise Refused(EXECUTION, f"code {code}: expected 1 to {2**31 - 1}")
    return code
