"""The parts of a cell in most ticks: what is held goes along, and nothing else moves."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cython

from iiwa_sim.frames import Transform
from iiwa_sim.handling.gripper import CLOSES, OPENS, Gripper
from iiwa_sim.wrench import NO_WRENCH, Wrench

if cython.compiled:
    from cython.cimports.iiwa_sim.handling.held_kernel import Held
else:
    from iiwa_sim.handling.held_kernel import Held

_CLOSES = cython.declare(cython.int, CLOSES)
_OPENS = cython.declare(cython.int, OPENS)


@cython.cclass
class Pieces:
    """The parts, as far as all ticks ask for them; what else becomes of them is up to heirs in Python.

    The attributes are declared in the .pxd.
    """

    def __init__(self, gripper: Gripper) -> None:
        """Nothing is held, and nothing lies; what the attributes are is said in the .pxd."""
        self._gripper = gripper
        self.changes = self.lying_changes = 0
        self.pushed: set[str] = set()
        self._lively: set[str] = set()
        self._lying: list[str] | None = None
        self._held: Held | None = None
        self._tcp: Transform | None = None
        self._lost = ""

    if TYPE_CHECKING:

        @property
        def lying(self) -> list[str]:
            """The names of the parts that lie."""

        def _all_solid(self) -> Any:
            """What the held part may touch."""

        def _let_go(self) -> None:
            """What is held goes on as fast as it is."""

        def _move_lively(self) -> None:
            """A tick of the parts that fall or slide."""

    @property
    def in_jaws(self) -> Held | None:
        """The part between the jaws."""
        return self._held

    @property
    def held(self) -> str:
        """The name of the part that is held, if any."""
        return "" if self._held is None else self._held.part.name

    @property
    def wrench(self) -> Wrench:
        """What the held part does to the TCP, along its axes."""
        return NO_WRENCH if self._held is None else self._held.wrench

    @property
    def weight(self) -> Wrench:
        """Of that its weight alone."""
        return NO_WRENCH if self._held is None else self._held.weight

    @property
    def width_m(self) -> float:
        """Of what is held, between the jaws; 0 for nothing."""
        return 0.0 if self._held is None else self._held.width_m

    @property
    def settled(self) -> bool:
        """Whether ticks change nothing as long as TCP and jaws stay where they are."""
        return not self._lively and (self._held is None or self._held.quiet)

    @property
    def moving(self) -> list[str]:
        """The names of the parts that lie and move, as the cell orders them: a set does so otherwise."""
        return [name for name in self.lying if name in self._lively] if self._lively else []

    @cython.ccall
    def step(self, tcp: Transform, coming: Transform | None = None) -> object:
        """A tick has brought the TCP there, and the jaws to where they are; the next one is to bring it to
        `coming`, if that is known."""
        self._tcp = tcp
        driven: cython.int = self._gripper.driven
        if driven != _CLOSES and self._lost:
            self._lost = ""
        held = self._held
        if held is not None:
            if driven == _OPENS and self._gripper.opening_m > held.width_m:
                self._let_go()
            elif not (held.quiet and held.stays(tcp, coming)):
                holds: cython.bint = held.step(tcp, coming, self._all_solid)
                if not held.quiet:
                    self.changes += 1
                if not holds:
                    self.lose()
        if self._lively:
            self._move_lively()
        return None

    def lose(self) -> None:
        """What is held is lost: it falls, and is not held again before the jaws have opened."""
        self._lost = self.held
        self._let_go()
