"""The tick of gripper and parts: in most of them the jaws rest."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cython

from iiwa_sim.controller.io import Io
from iiwa_sim.frames import Transform
from iiwa_sim.handling.gripper import Gripper
from iiwa_sim.motion.joints import Joints
from iiwa_sim.wrench import NO_WRENCH

if TYPE_CHECKING:
    from iiwa_sim.handling.workpieces import Workpieces
elif cython.compiled:
    from cython.cimports.iiwa_sim.handling.pieces_kernel import Pieces as Workpieces
else:
    from iiwa_sim.handling.pieces_kernel import Pieces as Workpieces


if cython.compiled:
    from cython.cimports.iiwa_sim.contact.load_kernel import ExternalLoad
    from cython.cimports.iiwa_sim.handling.aside_kernel import Aside
    from cython.cimports.iiwa_sim.robot.feeling_kernel import Reached
else:
    from iiwa_sim.contact.load_kernel import ExternalLoad
    from iiwa_sim.handling.aside_kernel import Aside
    from iiwa_sim.robot.feeling_kernel import Reached


@cython.cclass
class HandlingTicks:
    """The gripper of one robot and the parts in its cell, tick by tick; what the jaws do is up to heirs.

    The attributes are declared in the .pxd.
    """

    def __init__(self, gripper: Gripper, io: Io, load: ExternalLoad) -> None:
        """There are no parts yet; what the attributes are is said in the .pxd."""
        self.gripper, self._io, self._load = gripper, io, load
        self.workpieces: Workpieces | None = None
        self._aside: Aside | None = None
        self._rest: Any = None
        self._changes = load.world.changes

    if TYPE_CHECKING:

        def _jaws_rest(self) -> bool:
            """Whether the jaws stay as they are in this tick."""

        def _move_jaws(self, tcp: Transform | None) -> None:
            """A tick of the jaws, with the TCP at that pose; None where there are no parts."""

        def _tell(self) -> None:
            """Switch the inputs."""

    @property
    def holds(self) -> bool:
        """Whether a part is held."""
        return self.workpieces is not None and self.workpieces._held is not None

    def look_at_surfaces(self) -> None:
        """Tell the parts where surfaces are now, if these have come, gone or moved."""
        world = self._load.world
        if self.workpieces is not None and self._changes != world.changes:
            self._changes = world.changes
            self.workpieces.surfaces_are(list(world.surfaces.values()))

    @cython.cfunc
    def step(self, joints: Joints, contact: Reached | None, coming: Transform | None) -> object:
        """A tick, which has moved the robot to `joints` (rad); `contact` is what it has felt, and `coming`
        where the next tick brings the TCP, if that is known."""
        pieces, load, opening, known = self.workpieces, self._load, self.gripper.opening_m, self._rest
        held = None if pieces is None else pieces._held
        rest: cython.bint = known is not None and known[0] is self._io.outputs and known[1] is held
        if not (rest and known[2] == opening):
            rest = self._jaws_rest()
            self._rest = (self._io.outputs, held, opening) if rest else None
        if pieces is None:
            if not rest:
                self._move_jaws(None)
                self._tell()
            return None
        if self._changes != load.world.changes:
            self.look_at_surfaces()
        tcp = load.tcp(joints) if contact is None else contact.pose
        if not rest:
            self._move_jaws(tcp)
            opening = self.gripper.opening_m
        if self._aside is not None:
            self._aside.step(tcp, joints, opening)
        lively: cython.bint = len(pieces._lively) > 0
        pieces.step(tcp, coming)
        if lively and self._aside is not None:
            self._aside.follow()
        held = pieces._held
        if held is None:
            load.hand(NO_WRENCH, NO_WRENCH)
        else:
            load.hand(held.wrench, held.weight)
        if not rest:
            self._tell()
        return None
