"""Saved states of a cell."""

from typing import NamedTuple

from iiwa_sim.contact.external_wrench import ContactState
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.carrying import ToolLoad
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.handling import HandlingState
from iiwa_sim.frames import Transform
from iiwa_sim.motion.joints import Joints
from iiwa_sim.settings import LONGEST_NAME
from iiwa_sim.wording import harmless
from iiwa_sim.wrench import Wrench

START = "start"
"""The initial state of the simulator."""


class State(NamedTuple):
    """Saved state: everything that outlasts a stop, except time, errors and random numbers."""

    joints: Joints
    tool_in_flange: Transform
    override: float
    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]
    wrench: Wrench
    joint_push: tuple[float, ...]
    surfaces: tuple[Surface, ...]
    tool_load: ToolLoad
    handled: HandlingState | None
    """State of the gripper and the parts, if there are any."""
    felt: ContactState
    """Contacts, with their friction and entry sides."""


class States:
    """The saved states of a cell."""

    def __init__(self, *controllers: Controller) -> None:
        self._controllers = controllers
        self._kept = {START: self._present()}

    @property
    def names(self) -> list[str]:
        return list(self._kept)

    def save(self, name: str) -> None:
        """Save the present state; raises `Refused` while a robot moves, and for a malformed name."""
        self._check_rest()
        if name == START:
            raise Refused(EXECUTION, f"{START} is the state at the beginning: expected another name")
        if not (name.strip() and name.isprintable() and len(name) <= LONGEST_NAME):
            raise Refused(EXECUTION, f"expected a name of up to {LONGEST_NAME} characters that print")
        self._kept[name] = self._present()

    def restore(self, name: str) -> None:
        """Restore a state; robots are then in no mode and have no error.

        Raises `Refused` while a robot moves, and if there is no such state.
        """
        if name not in self._kept:
            there_are = ", ".join(map(repr, self._kept))
            raise Refused(EXECUTION, harmless(f"no state {name!r}: there are {there_are}"))
        if len(self._controllers) > 1:
            self._check_rest()
        for controller, state in zip(self._controllers, self._kept[name], strict=True):
            _restore(controller, state)

    def _check_rest(self) -> None:
        if any(controller.moving for controller in self._controllers):
            who = "the robot has" if len(self._controllers) == 1 else "all robots have"
            raise Refused(EXECUTION, f"{who} to be at rest, with nothing waiting")

    def _present(self) -> list[State]:
        return [_present(controller) for controller in self._controllers]


def _restore(controller: Controller, state: State) -> None:
    world = controller.load.world
    controller.place(state.joints)
    for there in world.surfaces:
        world.remove(there)
    for surface in state.surfaces:
        world.put(surface)
    controller.set_tool(state.tool_in_flange)
    controller.set_override(state.override)
    for number, on in enumerate(state.inputs, 1):
        controller.io.wire(number, on)
    for number, on in enumerate(state.outputs, 1):
        controller.io.set_output(number, on)
    controller.load.wrench, controller.load.joint_push = state.wrench, state.joint_push
    controller.set_tool_load(state.tool_load)
    if controller.handling is not None and state.handled is not None:
        controller.handling.restore(state.handled)
    controller.load.feel_again(state.felt, state.joints)
    controller.allow_excess()
    controller.release_emergency_stop()
    controller.switch_drives(on=True)
    controller.reset_error()


def _present(controller: Controller) -> State:
    handling = controller.handling
    return State(
        joints=controller.joints,
        tool_in_flange=controller.tool_in_flange,
        override=controller.override,
        inputs=controller.io.inputs,
        outputs=controller.io.outputs,
        wrench=controller.load.wrench,
        joint_push=controller.load.joint_push,
        surfaces=tuple(controller.load.world.surfaces.values()),
        tool_load=controller.tool_load,
        handled=None if handling is None else handling.kept(),
        felt=controller.load.felt(),
    )
