"""Saved states of a cell: everything that outlasts a stop, except time, errors and random numbers."""

from collections.abc import Callable

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.settings import LONGEST_NAME
from iiwa_sim.wording import harmless

START = "start"
"""The initial state of the simulator."""


class States:
    """The saved states of a cell."""

    def __init__(self, *controllers: Controller) -> None:
        self._controllers = controllers
        self.kept = {START: [_kept(each) for each in controllers]}

    def save(self, name: str) -> None:
        """Save the present state; raises `Refused` while a robot moves, and for a malformed name."""
        self._check_rest()
        if name == START:
            raise Refused(EXECUTION, f"{START} is the state at the beginning: expected another name")
        if not (name.strip() and name.isprintable() and len(name) <= LONGEST_NAME):
            raise Refused(EXECUTION, f"expected a name of up to {LONGEST_NAME} characters that print")
        self.kept[name] = [_kept(each) for each in self._controllers]

    def restore(self, name: str) -> None:
        """Restore a state; robots are then in no mode and have no error.

        Raises `Refused` while a robot moves, and if there is no such state.
        """
        if name not in self.kept:
            there_are = ", ".join(map(repr, self.kept))
            raise Refused(EXECUTION, harmless(f"no state {name!r}: there are {there_are}"))
        self._check_rest()
        for restore in self.kept[name]:
            restore()

    def _check_rest(self) -> None:
        if any(controller.moving for controller in self._controllers):
            raise Refused(EXECUTION, "all robots have to be at rest, with nothing waiting")


def _kept(controller: Controller) -> Callable[[], None]:
    """Return a function that restores the present state of a robot at rest."""
    load, world, io, handling = controller.load, controller.load.world, controller.io, controller.handling
    joints, tool_in_flange, override = controller.joints, controller.tool_in_flange, controller.override
    inputs, outputs, surfaces = io.inputs, io.outputs, tuple(world.surfaces.values())
    wrench, joint_push, tool_load = load.wrench, load.joint_push, controller.tool_load
    allowed = controller.protection.allowed
    restore_bodies = None if handling is None else handling.kept()
    felt = load.felt()  # contacts, with their friction and entry sides

    def restore() -> None:
        for there in world.surfaces:
            world.remove(there)
        for surface in surfaces:
            world.put(surface)
        controller.place(joints, tool_in_flange)
        controller.set_override(override)
        for number, on in enumerate(inputs, 1):
            io.wire(number, on)
        for number, on in enumerate(outputs, 1):
            io.set_output(number, on)
        load.wrench, load.joint_push = wrench, joint_push
        controller.set_tool_load(tool_load)
        if restore_bodies is not None:
            restore_bodies()
        load.feel_again(felt, joints)
        controller.errors.release_emergency_stop()
        controller.switch_drives(on=True)
        controller.errors.reset()
        controller.protection.allowed = allowed

    return restore
