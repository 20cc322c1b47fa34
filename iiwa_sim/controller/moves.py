"""How the controller takes moves: checked, planned from where the robot will be, and queued or headed for."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from iiwa_sim.controller.acceleration import capped_joints
from iiwa_sim.controller.endings import PendingMove, WhenEnded
from iiwa_sim.controller.errors import COMPONENT_NOT_READY, EXECUTION, REPLACED, STOP_TRIGGERED, Refused
from iiwa_sim.controller.force_guard import ForceGuard, check_thresholds
from iiwa_sim.controller.modes import TRANSITIONS, Event, Mode
from iiwa_sim.controller.planner import Plan
from iiwa_sim.controller.requests import Kind, MoveRequest, TcpCompliance, shifted
from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.springs import CartesianImpedance

if TYPE_CHECKING:
    from iiwa_sim.controller.controller import Controller

LONGEST_QUEUE = 1000
"""Moves that wait; one more is refused."""
LARGEST_N_PER_M = 5000.0
"""Published: the original's."""
LARGEST_NM_PER_RAD = 5000.0
"""Our decision."""
SERVO_EVENTS = {Kind.SMART: Event.SMART_MOVE, Kind.DIRECT: Event.DIRECT_MOVE}


class Moves:
    """Takes moves of all kinds for one robot."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller

    def move(self, request: MoveRequest, when_ended: WhenEnded | None = None) -> int:
        """Take a move; gives its number. Raises `Refused`, and then nothing has changed.

        - PTP and LIN queue behind what runs. With thresholds the robot begins to stop on its path in the tick
          after a force is beyond its threshold, and then goes on with the next move; forces are watched from
          the tick in which the move begins to the one before it ends.
        - With compliance a move replaces what runs, and so does a hold: that begins where the robot has come
          to rest, and ends with a stop, a move with compliance, or another hold; other moves are refused.
        - Servos head for their target at once.

        A shift is resolved now: what becomes of the moves before does not change its target. `when_ended` is
        told how the move ended.
        """
        controller, endings, guard = self._controller, self._controller.endings, None
        if request.shift is not None:
            way, in_tool = request.shift
            start = controller.tcp(controller.end_of_queue)
            request = request._replace(target=shifted(start, way, in_tool=in_tool))
        if request.kind in SERVO_EVENTS:
            number = self._head_for(request)
        elif request.kind is Kind.HOLD:
            number = self._hold(request.hold_nm_per_rad)
        elif request.compliance is not None:
            number = self._give_way(request, request.compliance)
        else:
            number = self._queue(request)
            if request.thresholds is not None:
                guard = ForceGuard(number, request.thresholds, controller.cartesian_force())
        if guard or when_ended or endings.listeners or endings.on_discarded:
            endings.pending.append(PendingMove(number, when_ended, guard))
        return number

    def check(self, request: MoveRequest) -> None:
        """Raises `Refused` where a PTP or LIN would be for its target; changes nothing."""
        self._planned(request, self._controller.end_of_queue)

    def cancel_move(self) -> None:
        """End the move that runs: stop on its path, and go on with the next one from where the robot then is.

        In a servo mode that is the move to the present target; the mode stays. Where nothing runs, or the
        robot is being stopped, nothing changes.
        """
        self.check_hold()
        with self._controller.endings.because(STOP_TRIGGERED, "cancelled"):
            self._controller.motions.cancel()

    def clear_queue(self) -> None:
        """Forget the moves that wait; the one that runs ends at its target.

        Where it has begun to blend into the next one, or is about to and too fast to rest at its target, the
        robot stops on its path.
        """
        with self._controller.endings.because(STOP_TRIGGERED, "forgotten: the queue was cleared"):
            self._controller.motions.clear()

    def check_hold(self) -> None:
        """Raises `Refused` while a gravity hold is on, or begins when the robot is at rest."""
        if self._controller.mode is Mode.IMPEDANCE and self._controller.motions.holding:
            raise Refused(COMPONENT_NOT_READY, "a gravity hold is on: stop ends it")

    def accept(self, event: Event) -> int:
        """Change the mode, which may stop the robot; gives the number of the move."""
        controller = self._controller
        change = TRANSITIONS[controller.mode, event]
        if change.stops:
            controller.stop_for(event, STOP_TRIGGERED, REPLACED)
        controller.mode = change.mode
        controller.accepted += 1
        return controller.accepted

    def _queue(self, request: MoveRequest) -> int:
        """Plan a normal move from where the robot will come to rest, and queue it."""
        controller = self._controller
        controller.errors.check()
        self.check_hold()
        if controller.motions.waiting >= LONGEST_QUEUE:
            raise Refused(
                EXECUTION, f"{LONGEST_QUEUE} moves are waiting already: get queue tells when fewer do"
            )
        plan = self._planned(request, controller.end_of_queue)
        if request.thresholds is not None:
            check_thresholds(request.thresholds)
        number = self.accept(Event.NORMAL_MOVE)
        controller.motions.append(self._move(number, request, plan))
        return number

    def _give_way(self, request: MoveRequest, compliance: TcpCompliance) -> int:
        """Plan a stiffness move from where the nominal motion is, and carry it out in place of what runs."""
        controller, motions = self._controller, self._controller.motions
        impedance = _impedance_of(compliance)
        controller.errors.check()
        stops = TRANSITIONS[controller.mode, Event.IMPEDANCE_MOVE].stops
        plan = self._planned(request, motions.rest_after_stop() if stops else motions.compliant_start)
        if motions.moving and not stops:
            controller.targets.check_way_back(plan.limits)
        number = self.accept(Event.IMPEDANCE_MOVE)
        with controller.endings.because(STOP_TRIGGERED, REPLACED):
            motions.move_compliantly(self._move(number, request, plan), impedance)
        return number

    def _hold(self, stiffness_nm_per_rad: float) -> int:
        controller = self._controller
        controller.errors.check()
        _check_stiffness(stiffness_nm_per_rad, LARGEST_NM_PER_RAD, "Nm/rad")
        number = self.accept(Event.IMPEDANCE_MOVE)
        with controller.endings.because(STOP_TRIGGERED, REPLACED):
            controller.motions.hold(number, stiffness_nm_per_rad)
        return number

    def _head_for(self, request: MoveRequest) -> int:
        """Find the target of a servo from where that will set out, and head for it."""
        controller, motions, event = self._controller, self._controller.motions, SERVO_EVENTS[request.kind]
        controller.errors.check()
        self.check_hold()
        change = TRANSITIONS[controller.mode, event]
        here = motions.rest_after_stop() if change.stops else motions.present
        moving = motions.moving and not change.stops
        joints, limits = controller.targets.find(request, change.mode, here, moving)
        if request.acceleration is not None:
            limits = capped_joints(limits, request.acceleration)
        number = self.accept(event)
        with controller.endings.because(STOP_TRIGGERED, REPLACED):
            motions.head_for(number, joints, limits)
        controller.servo_heard = controller.tick
        return number

    def _planned(self, request: MoveRequest, start: Joints) -> Plan:
        return self._controller.planner.plan(request, start, self._controller.tcp_of_arm)

    def _move(self, number: int, request: MoveRequest, plan: Plan) -> Move:
        return Move(number, *plan, lambda start: self._plan_again(number, request, start))

    def _plan_again(self, number: int, request: MoveRequest, start: Joints) -> Move | None:
        """Return an accepted move, begun elsewhere (rad); None, with a report, where it is impossible."""
        controller = self._controller
        try:
            plan = self._planned(request, start)
        except Refused as refused:
            lost = f"move {number} and those behind it are forgotten, planned again after a move ended early"
            reason = f"{lost}: {refused.reason}"
            controller.errors.record(refused.code, reason)
            controller.tell(refused.code, reason)
            controller.endings.lost(number, refused.code, reason)
            return None
        return self._move(number, request, plan)


def _impedance_of(compliance: TcpCompliance) -> CartesianImpedance:
    """Return how the TCP is to give way; raises `Refused` for numbers out of range."""
    _check_stiffness(compliance.stiffness_n_per_m, LARGEST_N_PER_M, "N/m")
    if not all(map(isfinite, compliance.balanced)):
        raise Refused(EXECUTION, "a force that is not finite")
    fx, fy, fz, tx, ty, tz = (0.0 - value for value in compliance.balanced)
    return CartesianImpedance(compliance.stiffness_n_per_m, (fx, fy, fz, tx, ty, tz))


def _check_stiffness(stiffness: float, largest: float, unit: str) -> None:
    if not 0.0 <= stiffness <= largest:
        raise Refused(EXECUTION, f"stiffness {stiffness:g} {unit}: expected 0 to {largest:g}")
