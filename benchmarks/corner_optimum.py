"""Makes data/corners_ROBOT.json: corners and their optimal durations, by nonlinear optimisation.

`python -m benchmarks.corner_optimum ROBOT FILE` needs casadi, which nothing else here does, and takes ten
minutes. It draws pairs of moves with a blended corner, runs them in the simulator, and improves the motion:
with IPOPT, over the timing on both paths and the motion of the joints inside the sphere at once.

The motion has three phases. On either path it is one number s with piecewise constant jerk; inside the sphere
the joints have piecewise constant jerk. Position, velocity and acceleration of the joints agree where phases
meet. Limits hold at all knots. The lengths of the pieces are free. The result is a local optimum, and between
knots limits may be exceeded slightly: it is accurate to some parts in a thousand.
"""

import json
import sys
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from benchmarks import corner_problems as problems
from benchmarks.corner_problems import DEGREE, TICK_S, Array, Corner, Line, Recorded, corners, recorded
from benchmarks.dense_paths import STARTS
from iiwa_sim.frames import compose
from iiwa_sim.robot.description import RobotDescription, load_robot
from iiwa_sim.robot.model import Model

HALF = 0.49  # largest part of a move inside a sphere
PIECES = 3  # of a path, each with knots at equal times
KNOTS = 16
FREE_KNOTS = 36
SHORTEST_S, LONGEST_S = 1e-3, 10.0  # per piece
BORDERS = 2000  # samples used to find where a path leaves its sphere
INSIDE = 0.9  # part of the sphere where the initial guess switches from paths to joints
SCALES = (1.0, 10.0, 100.0, 1000.0)  # bounds of s and its derivatives (1/s^k)


class Program:
    """The nonlinear program for two moves of one robot. It is built once; numbers are its parameters."""

    def __init__(self, description: RobotDescription) -> None:
        self.description, self.count = description, len(description.joints)
        self.velocity, self.acceleration, self.jerk = (
            np.array(each) for each in (description.velocity, description.acceleration, description.jerk)
        )
        self._variables: list[Any] = []
        self._constraints: list[Any] = []
        self._lowest: list[Array] = []
        self._highest: list[Array] = []
        n = self.count
        self._path = self._path_function()
        lines = [ca.SX.sym(f"line{k}", DEGREE + 1, n) for k in range(2)]
        speeds = [ca.SX.sym(f"speed{k}", n) for k in range(2)]
        centre, radius, borders = ca.SX.sym("centre", 3), ca.SX.sym("radius"), ca.SX.sym("borders", 2)
        first_s, first = self._on_path(lines[0], speeds[0])
        free_s, free = self._inside(ca.fmax(*speeds), centre, radius)
        second_s, second = self._on_path(lines[1], speeds[1])
        self._rests(first[0], 0.0)
        self._rests(second[-1], 1.0)
        self._joins(lines[0], first[-1], free[0])
        self._joins(lines[1], second[0], free[-1])
        self._holds(first[-1][0] - borders[0], 0.0, 1.0)
        self._holds(borders[1] - second[0][0], 0.0, 1.0)
        parameters = [*map(ca.vec, lines), *speeds, centre, radius, borders]
        program = {
            "x": ca.vertcat(*self._variables),
            "f": first_s + free_s + second_s,
            "g": ca.vertcat(*self._constraints),
            "p": ca.vertcat(*parameters),
        }
        options = {
            "ipopt": {
                "print_level": 0,
                "sb": "yes",
                "max_iter": 500,
                "tol": 1e-6,
                "acceptable_tol": 1e-4,
                "acceptable_iter": 10,
                "mu_strategy": "adaptive",
            },
            "print_time": 0,
        }
        self._solver = ca.nlpsol("corner", "ipopt", program, options)
        self._bounds = np.concatenate(self._lowest), np.concatenate(self._highest)

    def fastest_s(self, corner: Corner, known: Recorded) -> float:
        """The duration from rest to rest; raises ArithmeticError if IPOPT finds none."""
        description = self.description
        model, tool = Model(description), description.tool_in_flange
        at_corner = np.abs(known.exact - known.corner).max(axis=1).argmin()
        lines = [
            Line(description, corner.moves[0].kind, corner.start, known.corner, known.exact[: at_corner + 1]),
            Line(description, corner.moves[1].kind, known.corner, known.end, known.exact[at_corner:]),
        ]
        centre = np.array(compose(model.flange(known.corner), tool).translation)

        def distance(q: Array) -> float:
            return float(np.linalg.norm(compose(model.flange(q), tool).translation - centre))

        halves = [
            distance(lines[0].value(1.0 - HALF)),
            distance(lines[1].value(HALF)),
        ]
        radius = min(0.001 * corner.moves[0].blending_mm, *halves)
        parts = np.linspace(0.0, HALF, BORDERS)
        borders = [
            1.0 - problems.leaves([distance(lines[0].value(1.0 - part)) for part in parts], parts, radius),
            problems.leaves([distance(lines[1].value(part)) for part in parts], parts, radius),
        ]
        inside = np.flatnonzero([distance(q) <= INSIDE * radius for q in known.blended])
        guess = self._guess(lines, known.blended, int(inside[0]), int(inside[-1]))
        speeds = [self.velocity * move.speed_rel for move in corner.moves]
        parameters = [
            *(line.coefficients.ravel("F") for line in lines),
            *speeds,
            centre,
            [radius],
            borders,
        ]
        found = self._solver(x0=guess, p=np.concatenate(parameters), lbg=self._bounds[0], ubg=self._bounds[1])
        if not self._solver.stats()["success"]:
            raise ArithmeticError(f"{corner.name}: {self._solver.stats()['return_status']}")
        return float(found["f"])

    def _guess(self, lines: list[Line], q: Array, enters: int, leaves: int) -> Array:
        """The initial guess at the knots, from a known motion."""
        v = np.gradient(q, TICK_S, axis=0)
        a = np.gradient(v, TICK_S, axis=0)
        guess: list[Any] = []
        for line, first, last in (
            (lines[0], 0, enters),
            (None, enters, leaves),
            (lines[1], leaves, len(q) - 1),
        ):
            if line is None:
                duration = (last - first) * TICK_S
                guess.append([duration])
                at = np.linspace(first, last, FREE_KNOTS + 1)
                states = np.concatenate(
                    [
                        problems.at(q, at),
                        problems.at(v, at) / self.velocity,
                        problems.at(a, at) / self.acceleration,
                    ],
                    axis=1,
                )
            else:
                at = np.linspace(first, last, PIECES * KNOTS + 1)
                guess.append([(last - first) * TICK_S / PIECES] * PIECES)
                s = line.place(q[first : last + 1])
                ds = np.gradient(s, TICK_S)
                states = np.stack(
                    [problems.at(each, at - first) for each in (s, ds, np.gradient(ds, TICK_S))], axis=1
                )
                states[:, 1:] /= SCALES[1:3]
            guess += [states.ravel(), np.zeros((len(at) - 1) * states.shape[1] // 3)]
        return np.concatenate(guess)

    def _path_function(self) -> Any:
        s, c = ca.SX.sym("s"), ca.SX.sym("c", DEGREE + 1, self.count)
        basis = [ca.SX(1.0), 2.0 * s - 1.0]
        while len(basis) <= DEGREE:
            basis.append(2.0 * basis[1] * basis[-1] - basis[-2])
        q = ca.mtimes(c.T, ca.vertcat(*basis))
        dq = ca.jacobian(q, s)
        ddq = ca.jacobian(dq, s)
        return ca.Function("path", [s, c], [q, dq, ddq, ca.jacobian(ddq, s)])

    def _new(self, name: str, count: int, scale: Any = 1.0) -> Any:
        variable = ca.SX.sym(name, count)
        self._variables.append(variable)
        return variable * ca.DM(np.broadcast_to(scale, count).tolist())

    def _holds(self, what: Any, low: float, high: float) -> None:
        self._constraints.append(what)
        self._lowest.append(np.full(what.numel(), low))
        self._highest.append(np.full(what.numel(), high))

    def _on_path(self, line: Any, speed: Any) -> tuple[Any, list[Any]]:
        """The time on a path, and (s, ds, dds) at its knots. Variables: times, states, jerks."""
        times = self._new("times", PIECES)
        self._holds(times, SHORTEST_S, LONGEST_S)
        count = PIECES * KNOTS
        states = ca.reshape(
            self._new("states", 3 * (count + 1), np.tile(SCALES[:3], count + 1)), 3, count + 1
        )
        jerks = self._new("jerks", count, SCALES[3])
        found = []
        for k in range(count + 1):
            s, ds, dds = states[0, k], states[1, k], states[2, k]
            _, dq, ddq, dddq = self._path(s, line)
            self._holds(ds, 0.0, np.inf)
            self._holds(dq * ds / speed, -1.0, 1.0)
            self._holds((ddq * ds**2 + dq * dds) / self.acceleration, -1.0, 1.0)
            for jerk in {max(k - 1, 0), min(k, count - 1)}:  # those before the knot and after it
                self._holds((dddq * ds**3 + 3.0 * ddq * ds * dds + dq * jerks[jerk]) / self.jerk, -1.0, 1.0)
            found.append((s, ds, dds))
            if k < count:
                time = times[k // KNOTS] / KNOTS
                scales = [[scale] for scale in SCALES[:3]]
                self._goes_on(states[:, k], states[:, k + 1], jerks[k], time, *scales)
        return ca.sum1(times), found

    def _inside(self, speed: Any, centre: Any, radius: Any) -> tuple[Any, list[Any]]:
        """The time inside the sphere, and (q, dq, ddq) at its knots. Variables: time, states, jerks."""
        n, time = self.count, self._new("time", 1)
        self._holds(time, SHORTEST_S, LONGEST_S)
        scale = np.concatenate([np.ones(n), self.velocity, self.acceleration])
        states = ca.reshape(
            self._new("joints", 3 * n * (FREE_KNOTS + 1), np.tile(scale, FREE_KNOTS + 1)),
            3 * n,
            FREE_KNOTS + 1,
        )
        jerks = ca.reshape(self._new("jerks", n * FREE_KNOTS, np.tile(self.jerk, FREE_KNOTS)), n, FREE_KNOTS)
        found = []
        for k in range(FREE_KNOTS + 1):
            q, v, a = states[:n, k], states[n : 2 * n, k], states[2 * n :, k]
            self._holds(v / speed, -1.0, 1.0)
            self._holds(a / self.acceleration, -1.0, 1.0)
            off = self._tcp(q) - centre
            if 0 < k < FREE_KNOTS:
                self._holds(ca.dot(off, off) / radius**2, 0.0, 1.0)
            found.append((q, v, a))
            if k < FREE_KNOTS:
                self._holds(jerks[:, k] / self.jerk, -1.0, 1.0)
                self._goes_on(
                    states[:, k], states[:, k + 1], jerks[:, k], time / FREE_KNOTS, np.ones(n), self.velocity,
                    self.acceleration,
                )  # fmt: skip
        return time, found

    def _goes_on(self, now: Any, then: Any, jerk: Any, time: Any, *scales: Any) -> None:
        """Constrain two knots to be joined by constant jerk."""
        n = len(scales[0])
        x, v, a = now[:n], now[n : 2 * n], now[2 * n :]
        places = (
            x + time * v + time**2 / 2.0 * a + time**3 / 6.0 * jerk,
            v + time * a + time**2 / 2.0 * jerk,
            a + time * jerk,
        )
        for k, (place, scale) in enumerate(zip(places, scales, strict=True)):
            self._holds((then[k * n : (k + 1) * n] - place) / ca.DM(list(scale)), 0.0, 0.0)

    def _rests(self, state: Any, s: float) -> None:
        self._holds(ca.vertcat(state[0] - s, state[1], state[2]), 0.0, 0.0)

    def _joins(self, line: Any, on_path: Any, inside: Any) -> None:
        s, ds, dds = on_path
        q, dq, ddq, _ = self._path(s, line)
        self._holds(q - inside[0], 0.0, 0.0)
        self._holds((dq * ds - inside[1]) / self.velocity, 0.0, 0.0)
        self._holds((ddq * ds**2 + dq * dds - inside[2]) / self.acceleration, 0.0, 0.0)

    def _tcp(self, q: Any) -> Any:
        """The position of the TCP, by the product of rotations about the joint axes at zero pose."""
        model = Model(self.description)
        tool = self.description.tool_in_flange
        place = ca.DM(list(compose(model.flange([0.0] * self.count), tool).translation))
        axes, points = model.arm.axes, model.arm.points
        for k in range(self.count - 1, -1, -1):
            cross, point = ca.skew(ca.DM(axes[k])), ca.DM(points[k])
            rotation = ca.DM.eye(3) + ca.sin(q[k]) * cross + (1.0 - ca.cos(q[k])) * ca.mtimes(cross, cross)
            place = point + ca.mtimes(rotation, place - point)
        return place


def main() -> None:
    """Draw the corners of a robot, find their optima, and write them to a file."""
    robot, path = sys.argv[1:]
    description = load_robot(robot)
    program = Program(description)
    rows = []
    for corner in corners(description, STARTS[robot]):
        known = recorded(description, corner)
        try:
            optimum_s = program.fastest_s(corner, known)
        except ArithmeticError as unsolved:
            print(unsolved, flush=True)
            continue
        before_s, exact_s = (round((len(q) - 1) * TICK_S, 3) for q in (known.blended, known.exact))
        print(
            f"{corner.name}: {optimum_s:.4f} s, {before_s / optimum_s:.3f} of it, {exact_s / optimum_s:.3f}",
            flush=True,
        )
        rows.append(
            {
                "name": corner.name,
                "start": corner.start,
                "moves": [move.line for move in corner.moves],
                "angle_deg": round(corner.angle_deg, 1),
                "optimum_s": round(optimum_s, 4),
                "before_s": before_s,
                "exact_before_s": exact_s,
            }
        )
    Path(path).write_text(json.dumps({"robot": robot, "corners": rows}, indent=1))


if __name__ == "__main__":
    main()
