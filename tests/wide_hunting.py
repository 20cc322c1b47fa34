"""The hunt, with all that a robot can be told in it, and with more that is looked at.

What `tests/hunting.py` leaves out: force moves and forces, other modes, dense paths, relative moves, speeds
in m/s, capped accelerations, any blending in joints, poses near singular ones and at the joint limits, and
small overrides. Looked at are also the paths of lines, where each plan is beside its moves' paths and
spheres, whether a new plan keeps what it shall keep, position limits, and whether the end of each move is
told once.
"""

from __future__ import annotations

from collections.abc import Callable
from math import dist, radians

import numpy as np

from iiwa_sim.controller.acceleration import AccelerationCap, AccelerationUnit
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Frame, turn_between
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.motion.trajectory import Trajectory
from tests import asked
from tests.chains import UNTIL_STOPPED, ChainMove, aimed
from tests.hunting import STEP_S, Hunt
from tests.stepped import ROUNDING, Array, assert_within_positions, line_errors

USUAL = 0.5  # part of what is said that `Hunt` says, too
OFF_PATH_RAD = 1e-8  # of a joint in a plan: far below a micrometre at the TCP
OFF_LINE = 1e-6  # m and rad
OUT_OF_SPHERE = 1e-6  # of its radius
HALF = 0.49  # of a move in a corner, at the most
PLACES = 33  # of a line's path
EACH = 4  # of the places of a plan is looked at for its path
LONGEST_S = 1000.0  # of a program
STRETCHED_RAD = radians(4.76)  # A3 of a six-axis arm
SINGULAR = ("wrist", "through wrist", "elbow", "limit")
FORCE_N = 30.0


class WideHunt(Hunt):
    """One robot, and what it is told."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._plan: Trajectory | None = None
        self._accepted: list[int] = []
        self._ended: list[Ending] = []
        self.robot.controller.endings.listeners.append(self._ended.append)

    def run(self) -> None:
        """Says all of it, waits for the end, and looks whether each move has been told to have ended."""
        super().run()
        accepted = self.robot.controller.accepted
        numbers = [each.move for each in self._ended]
        assert sorted(numbers) == list(range(1, accepted + 1)), "the end of each move is told, once"
        assert_within_positions(self.robot.description, self.robot.joints)

    def _say(self, what: float) -> None:
        if self._rng.random() < USUAL:
            super()._say(what)
            return
        says = [self._says_one, self._says_one, self._says_one, self._says_dense]
        if self._how in ("stops", "all"):
            says += [self._says_servo, self._says_yielding, self._says_force_move]
        if self._how in ("overrides", "all"):
            says.append(self._says_override)
        self._one_of(says)()

    def _tell(self, request: MoveRequest) -> bool:
        """Whether it was taken."""
        robot, controller = self.robot, self.robot.controller
        robot.notice_mode()
        end = controller.end_of_queue
        try:
            controller.move(request)
        except Refused:
            return False
        finally:
            robot.notice_mode()
        self._starts.append(end)
        waiting = controller.motions._executor._waiting
        if request.kind is Kind.LIN and waiting.any and waiting.last.number == controller.accepted:
            self._look_at_line(waiting.last.path)
        return True

    def _says_one(self) -> None:
        """A move that `Hunt` does not send."""
        rng, end = self._rng, np.array(self.robot.controller.end_of_queue)
        kind = self._one_of(("joint", "ptp", "lin", "lin joint", "lin at", "relative", "capped"))
        parts = rng.uniform(-1.0, 1.0, len(end))
        place = self._one_of((*SINGULAR, "near", "shift", "small", "tiny", "turn", "on"))
        if place in SINGULAR:
            joints = self._singular(place, end, parts)
            frame = self.robot.tcp_frame(joints)
        else:
            joints, frame = self._aimed(place, parts)
        speed = self._one_of((1.0, 1.0, 0.5, 0.1))
        radius_mm = self._one_of((0.0, float(rng.uniform(0, 5)), float(rng.uniform(0, 80)), 500.0))
        speeds = [speed] * len(end)

        def relative() -> MoveRequest:
            way = Frame(*(150.0 * parts[:3]).tolist(), *(0.3 * parts[3:6]).tolist())
            return asked.lin_relative_move(way, speed, radius_mm, in_tool=bool(rng.random() < 0.5))

        def capped() -> MoveRequest:
            cap = AccelerationCap((float(rng.uniform(0.05, 1.0)),), AccelerationUnit.RELATIVE)
            joint = rng.random() < 0.5
            request = asked.joint_move(joints, speeds) if joint else asked.lin_move(frame, speed, radius_mm)
            return request._replace(acceleration=cap)

        made: dict[str, Callable[[], MoveRequest]] = {
            "joint": lambda: asked.joint_move(joints, speeds, self._one_of((0.0, 0.1, 0.5, 1.0))),
            "ptp": lambda: asked.ptp_move(frame, speed, radius_mm),
            "lin": lambda: asked.lin_move(frame, speed, radius_mm),
            "lin joint": lambda: asked.lin_joint_move(joints, speed, radius_mm),
            "lin at": lambda: asked.lin_move_at(frame, float(10.0 ** rng.uniform(-1.3, 0.5)), radius_mm),
            "relative": relative,
            "capped": capped,
        }
        self._tell(made[kind]())

    def _aimed(self, place: str, parts: Array) -> tuple[Joints, Frame]:
        """Joints and frame of a target, seen from where the queue ends."""
        end = self.robot.controller.end_of_queue
        speeds = (1.0,) * len(end)
        move = ChainMove("lin", place, tuple(parts.tolist()), speeds, 0.0, 0)
        return aimed(move, self.robot, end, (self._starts[-1] if self._starts else end, end))

    def _singular(self, place: str, end: Array, parts: Array) -> tuple[float, ...]:
        """Joints near where the wrist or the arm is stretched, beyond that, or at position limits."""
        d, rng = self.robot.description, self._rng
        low, high = np.array(d.position_min), np.array(d.position_max)
        joints = end + 0.06 * (high - low) * parts * self._one_of((0.0, 0.1, 1.0))
        little = self._one_of((0.0, 1.0, -1.0)) * 10.0 ** rng.uniform(-9.0, -1.0)
        if place == "wrist":
            joints[-2] = little
        elif place == "through wrist":
            joints[-2] = -end[-2]
        elif place == "elbow":
            if d.kinematics == "srs":
                joints[3] = little
            else:
                joints[2] = STRETCHED_RAD + little
        else:
            k = int(rng.integers(len(joints)))
            joints[k] = self._one_of((low[k], high[k]))
        return tuple(np.clip(joints, low, high).tolist())

    def _says_dense(self) -> None:
        """A circle, or a polyline, of short lines."""
        rng, here = self._rng, self.robot.tcp_frame(self.robot.controller.end_of_queue)
        count = int(rng.integers(3, 25))
        line_mm = 10.0 ** float(rng.uniform(-0.5, 1.6))
        angle = radians(float(rng.uniform(0.0, 90.0))) * self._one_of((0.1, 0.3, 1.0))
        turns = self._one_of(([1.0] * count, [(-1.0) ** k for k in range(count)]))
        radius_mm = line_mm * self._one_of((0.0, 0.2, 0.5, 0.5, 2.0))
        speed = self._one_of((1.0, 1.0, 0.1))
        axes = self._one_of(((0, 1), (1, 2), (0, 2)))
        place, way, waits = np.array(here), 0.0, self._one_of((0, 0, 1, 5, 40))
        for turn in turns:
            place[list(axes)] += line_mm * np.array([np.cos(way), np.sin(way)])
            way += turn * angle
            if not self._tell(asked.lin_move(Frame(*place.tolist()), speed, radius_mm)):
                return
            if self._how != "once":
                self._step(int(rng.integers(0, waits + 1)))

    def _says_servo(self) -> None:
        """Some targets of smart or direct mode."""
        rng, controller = self._rng, self.robot.controller
        direct = self._one_of((True, False))
        for _ in range(int(rng.integers(1, 6))):
            here = np.array(controller.joints)
            parts = rng.uniform(-1.0, 1.0, len(here))
            speeds = [float(rng.uniform(0.1, 1.0))] * len(here)
            if direct:
                self._tell(asked.direct_joint_move((here + 0.08 * parts).tolist(), speeds))
            else:
                self._tell(asked.smart_joint_move((here + 0.4 * parts).tolist(), speeds))
            self._step(int(rng.integers(0, 60)))

    def _says_yielding(self) -> None:
        """A stiffness move, or a hold and its end; nothing pushes the robot."""
        rng, robot, controller = self._rng, self.robot, self.robot.controller
        if rng.random() < 0.3:
            robot.notice_mode()
            robot.may_stop()
            self._tell(asked.gravity_hold(1000.0))
            robot.may_stop()
            self._step(int(rng.integers(0, 100)))
            robot.stop()
            return
        parts = rng.uniform(-1.0, 1.0, len(controller.joints))
        _, frame = self._aimed(self._one_of(("near", "shift")), parts)
        move = self._one_of((asked.lin_stiff_move, asked.ptp_stiff_move))
        self._tell(move(frame, self._one_of((1.0, 0.3)), 2000.0, [0.0] * 6))

    def _says_force_move(self) -> None:
        """A force move, and mostly a force that ends it."""
        rng, controller = self._rng, self.robot.controller
        parts = rng.uniform(-1.0, 1.0, len(controller.joints))
        _, frame = self._aimed(self._one_of(("near", "shift")), parts)
        move = self._one_of((asked.lin_force_move, asked.ptp_force_move))
        radius_mm = self._one_of((0.0, 30.0, 500.0))
        if not self._tell(move(frame, self._one_of((1.0, 0.3)), radius_mm, (10.0, None, 10.0))):
            return
        if rng.random() < 0.5:
            self._says_one()
        self._step(int(rng.integers(0, 400)))
        if controller.mode is Mode.NORMAL and rng.random() < 0.7:
            controller.load.wrench = (FORCE_N, 0.0, 0.0, 0.0, 0.0, 0.0)
            self._step(int(rng.integers(1, 40)))
            controller.load.wrench = (0.0,) * 6

    def _says_override(self) -> None:
        """Some overrides, also small ones, one after the other; at the end one that leads on."""
        rng, controller = self._rng, self.robot.controller
        for _ in range(int(rng.integers(1, 6))):
            controller.set_override(self._one_of((0.0, 1.0, 0.01, *rng.uniform(0.05, 1.0, 2).tolist())))
            self._step(int(rng.integers(0, 300)) // round(1e3 * self.robot.tick_s))
        controller.set_override(float(rng.uniform(0.3, 1.0)))

    def _wait(self, ticks: int) -> None:
        if ticks == UNTIL_STOPPED and self.robot.controller.motions.holding:
            self.robot.stop()
        super()._wait(ticks)

    def _step(self, ticks: int) -> None:
        super()._step(ticks)
        assert len(self.robot.joints) * self.robot.tick_s < LONGEST_S, "still moving"

    def _look_at(self, plan: Trajectory) -> None:
        super()._look_at(plan)
        before, self._plan = self._plan, plan
        now_s = self.robot.controller.motions._executor.time.time_s
        if before is not None and 0.0 < now_s < plan.front_s:
            kept = np.arange(now_s, min(plan.front_s, plan.end_s, before.end_s), STEP_S)
            if len(kept):
                off = np.abs(plan.sample(kept) - before.sample(kept)).max()
                assert off <= OFF_PATH_RAD, f"what is kept of a plan changes by {off} rad"
        times = np.arange(plan.front_s, plan.end_s, EACH * STEP_S)
        if len(times):
            self._look_at_places(plan, times)

    def _look_at_places(self, plan: Trajectory, times: Array) -> None:
        """Whether each is on the path of its move, or in the sphere of its corner, and no joint too far."""
        path = plan.path
        borders = np.array(path.borders)
        q, x = plan.sample(times), np.array([plan.x(time_s) for time_s in times])
        assert_within_positions(self.robot.description, q)
        assert (np.diff(x) >= -1e-12).all(), "the robot goes back"
        lengths, on_path = np.diff(borders), np.ones(len(x), bool)
        for k in range(1, len(path.moves)):
            before, after, _ = path.blends[k - 1]
            assert before <= HALF + ROUNDING
            assert after <= HALF + ROUNDING
            if before == 0.0:
                continue
            first = borders[k] - before * lengths[k - 1]
            last = borders[k] + after * lengths[k]
            inside = (x > first) & (x < last)
            on_path &= ~inside
            zone = path.moves[k - 1].zone
            assert zone is not None
            if inside.any():
                farthest = float(zone.distances(q[inside]).max())
                assert farthest <= zone.radius * (1.0 + OUT_OF_SPHERE) + 1e-9, f"{farthest} of {zone.radius}"
        for k, move in enumerate(path.moves):
            on = on_path & (x >= borders[k]) & (x <= borders[k + 1])
            if on.any():
                s = np.clip((x[on] - borders[k]) / lengths[k], 0.0, 1.0)
                off = float(np.abs(move.path.derivatives(s)[0] - q[on]).max())
                assert off <= OFF_PATH_RAD, f"{off} rad off the path of move {move.number}"

    def _look_at_line(self, path: Polynomial) -> None:
        """Whether the TCP goes straight, and turns evenly."""
        joints = [path.joints(s) for s in np.linspace(0.0, 1.0, PLACES).tolist()]
        start, end = self.robot.tcp(joints[0]), self.robot.tcp(joints[-1])
        _, angle = turn_between(start.rotation, end.rotation)
        if dist(start.translation, end.translation) > OFF_LINE:
            off_m, off_rad = line_errors(self.robot, joints, Frame.from_transform(end))
            assert off_rad <= OFF_LINE or angle >= 3.0, f"{off_rad} rad off the arc"  # else there are two
        else:
            off_m = max(dist(start.translation, self.robot.tcp(q).translation) for q in joints)
        assert off_m <= OFF_LINE, f"{off_m} m off the line"
