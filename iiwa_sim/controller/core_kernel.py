"""The tick of a controller: the robot moves, then feels what pushes it, then compares with limits."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cython
from cython.cimports.libc.math import fabs

from iiwa_sim.controller.endings import Endings
from iiwa_sim.controller.force_guard import ForceGuard
from iiwa_sim.controller.handling import Handling
from iiwa_sim.controller.meetings import Meetings
from iiwa_sim.controller.motions import Motions
from iiwa_sim.controller.protection import Protection
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.surroundings import STIFF
from iiwa_sim.wrench import Wrench

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.load_kernel import ExternalLoad
    from cython.cimports.iiwa_sim.controller.tolerance_kernel import Tolerance
else:
    from iiwa_sim.contact.load_kernel import ExternalLoad
    from iiwa_sim.controller.tolerance_kernel import Tolerance


@cython.cclass
class CoreTicks:
    """One robot, tick by tick; what happens in few ticks only is up to heirs in Python."""

    tick: int = cython.declare(cython.long, visibility="public")
    """The number of ticks so far."""
    tick_s: float = cython.declare(cython.double, visibility="public")
    motions: Motions = cython.declare(object, visibility="public")
    load: ExternalLoad = cython.declare(ExternalLoad, visibility="public")
    handling: Handling | None = cython.declare(object, visibility="public")
    """The gripper and the parts, if there are any."""
    protection: Protection = cython.declare(Tolerance, visibility="public")
    endings: Endings = cython.declare(object, visibility="public")
    joints_before: Joints = cython.declare(object, visibility="public")
    """Joint positions (rad) at the end of the tick before the last one."""
    watch_trajectory: Any = cython.declare(object, visibility="public")
    """Called after each tick in which a trajectory is followed, or has just ended; None for nobody."""
    _meetings: Meetings | None = cython.declare(object, visibility="public")
    _servo_timeout_s: float | None = cython.declare(object, visibility="public")

    if TYPE_CHECKING:

        def _watch_servo(self) -> None:
            """End a servo mode that hears of no command."""

        def _fail_in_tick(self, fault: Exception) -> None:
            """Stop after an internal error."""

        def cartesian_force(self) -> Wrench:
            """The reading of the wrench at the TCP, along its axes."""

        def _watch_forces(self, guard: ForceGuard) -> None:
            """End a force move that has met a force."""

        def _protect(self) -> None:
            """Stop a robot that is pushed too hard, or runs where or faster than it may."""

    @property
    def under_way(self) -> bool:
        """Whether the robot moves, and will stop without another command: not in a pause by an override of 0,
        nor in a gravity hold; or whether its gripper does."""
        handling = self.handling
        return bool(self.motions.ends_by_itself or (handling is not None and handling.under_way))

    def step(self) -> None:
        """One tick: the robot moves, then feels the forces where it is now, then compares with thresholds.

        So a stop that a force asks for begins in the tick after the one in which its threshold is passed. An
        internal error in a tick stops the robot, sets the error state, and is raised.
        """
        if self._servo_timeout_s is not None:
            self._watch_servo()
        self.tick += 1
        motions, load = self.motions, self.load
        self.joints_before = motions.joints
        try:
            motions.step()
        except Exception as fault:
            self._fail_in_tick(fault)
            raise
        if motions.tracking and self.watch_trajectory is not None:
            self.watch_trajectory()
        # Of what most ticks have nothing of only that is asked.
        endings = self.endings
        acts: cython.bint = False
        if endings.pending and endings.pending[0].number != motions.under_way:
            endings.after_tick()
        if self.handling is not None or not load.is_idle(self.tick):
            self._feel()
            acts = load._acts()
        if endings.pending:
            guard = endings.pending[0].guard
            if guard is not None and self._passes(guard):
                self._watch_forces(guard)
        protection = self.protection
        if protection.looks_always or (acts and not protection.tolerates(load)):
            self._protect()
        meetings = self._meetings
        if meetings is not None and (
            (acts and (meetings.touching or load.link_contacts)) or self.tick % meetings.every == 0
        ):
            meetings.after_tick(self.tick, motions.joints != self.joints_before)

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def _passes(self, guard: Any) -> cython.bint:
        """Whether a force has changed by more than a threshold of a guard, whatever move that is for."""
        wrench = self.cartesian_force()
        thresholds, offset = guard.thresholds, guard.offset
        most: cython.double
        now: cython.double
        before: cython.double
        for axis in range(3):
            if thresholds[axis] is not None:
                most, now, before = thresholds[axis], wrench[axis], offset[axis]
                if fabs(now - before) > most:
                    return True
        return False

    @cython.cfunc
    def _feel(self) -> object:
        """Find what pushes the robot where a tick has brought it."""
        motions, load, handling = self.motions, self.load, self.handling
        joints, contact = motions.joints, motions.tcp_contact
        tcp: Any = None
        coming: Any = None
        next_joints: Any = None
        if load._motion is not None or load.bodies is not None:
            tcp = load.tcp(joints)  # where it has come to was found a tick ago
            next_joints = motions.coming
            coming = None if next_joints is None else load.coming_tcp(next_joints)
        if handling is not None:
            stiffness = motions.compliance if next_joints is None and load.bodies is not None else STIFF
            handling.step(joints, next_joints, tcp, coming, stiffness)
        load.step(joints, self.tick, self.tick_s, contact, coming)
        return None
