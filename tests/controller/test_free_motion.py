"""No free motion stops itself. Random loads that the controller knows of, by a seed, on the bare core.

The arm carries a tool up to its payload, with a centre of mass off the axis and an inertia, or holds a part
with it, and the controller is told that load as a driver would. Watched are the torques on its joints, and
for a tool alone the least forces, too: of a part nobody can tell the controller the inertia.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box
from iiwa_sim.controller.carrying import Inertia, Tool, ToolLoad
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.handling import HandlingSetup, HandlingState, Wiring
from iiwa_sim.controller.protection import Safety
from iiwa_sim.frames import Frame, Vector, apply
from iiwa_sim.handling.falling import HELD, STILL, Body
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.workpieces import Parts
from iiwa_sim.robot.description import load_robot
from tests.asked import direct_joint_move, joint_move, lin_move, smart_joint_move
from tests.samples import some

PAYLOAD_KG = {"lbr_iiwa_7_r800": 7.0, "lbr_iiwa_14_r820": 14.0, "kr_6_r900_sixx": 6.0}
FARTHEST_MM = 200.0
TICKS_S = (0.001, 0.002, 0.002, 0.004, 0.01)
JAWS = Jaws(0.4, 0.4, 1e6)
CLOSE = 1
LEAST = Safety(force_n=1e-6, torque_nm=1e-6)


class FreeScene:
    """One arm and what it carries."""

    def __init__(self, seed: int) -> None:
        rng = self._rng = np.random.default_rng(seed)
        name = list(PAYLOAD_KG)[rng.integers(3)]
        payload_kg = PAYLOAD_KG[name]
        tool_kg = float(rng.uniform(0.0, payload_kg))
        self._part: Part | None = None
        handled = None
        if rng.random() < 0.3:
            shape = Box(*rng.uniform(0.005, 0.1, 3).tolist())
            self._part = Part("it", shape, 1e-3 + float(rng.uniform(0.0, payload_kg - tool_kg)), 1.0, 1e5)
            handled = HandlingSetup(
                JAWS, Wiring(CLOSE), ((self._part, Frame(0, 0, 0, 0, 0, 0).to_transform()),)
            )
        self._tool = Tool(ToolLoad(tool_kg, self._centre()), self._inertia(tool_kg))
        x, y, z = self._centre()
        in_flange = Frame(1e3 * x, 1e3 * y, 1e3 * z, *rng.normal(size=3).tolist()).to_transform()
        self._description = load_robot(name)
        self.controller = Controller(
            self._description,
            float(TICKS_S[rng.integers(len(TICKS_S))]),
            tool_in_flange=in_flange,
            safety=Safety() if self._part else LEAST,
            tool=self._tool,
            handled=handled,
            on_fault=lambda _, reason: self._stopped(reason),
        )
        self.motions = 0
        self.stops: list[str] = []
        """Why it has stopped itself."""

    def _stopped(self, reason: str) -> None:
        if not self.controller.load.folded:  # links in each other are no free motion
            self.stops.append(reason)

    def _centre(self) -> Vector:
        x, y, z = (1e-3 * self._rng.uniform(-FARTHEST_MM, FARTHEST_MM, 3)).tolist()
        return (x, y, z)

    def _inertia(self, mass_kg: float) -> Inertia:
        """Of some points that weigh as much."""
        points = self._rng.normal(size=(4, 3)) * 0.1
        points -= points.mean(axis=0)
        found = 0.25 * mass_kg * (np.einsum("pi,pi->", points, points) * np.eye(3) - points.T @ points)
        ixx, iyy, izz = np.diag(found).tolist()
        return (ixx, iyy, izz, float(found[0, 1]), float(found[0, 2]), float(found[1, 2]))

    def _holds(self, part: Part) -> ToolLoad:
        """Have the part between the jaws; gives the load that is right then."""
        controller = self.controller
        x, z = self._rng.uniform(-20.0, 0.0, 2).tolist()
        in_tcp = Frame(x, 0.0, z, *self._rng.choice([0.0, 0.5], 3).tolist()).to_transform()
        body = Body(part, controller.tcp(), STILL, HELD)
        handling = controller.handling
        assert handling is not None
        controller.io.set_output(CLOSE, True)
        handling.restore(HandlingState(0.1, Parts((body,), in_tcp)), controller.tcp())
        held = apply(controller.tool_in_flange, in_tcp.translation)
        mass = self._tool.load.mass_kg + part.mass_kg
        x, y, z = (
            (self._tool.load.mass_kg * a + part.mass_kg * b) / mass
            for a, b in zip(self._tool.load.centre, held, strict=True)
        )
        return ToolLoad(mass, (x, y, z))

    def run(self) -> FreeScene:
        """Some motions."""
        rng, controller = self._rng, self.controller
        load = self._tool.load if self._part is None else self._holds(self._part)
        if self._part is not None or rng.random() < 0.5:
            mass, *centre = load.told()
            controller.set_tool_load(ToolLoad(mass, (1e-3 * centre[0], 1e-3 * centre[1], 1e-3 * centre[2])))
        for _ in range(int(rng.integers(2, 7))):
            controller.set_override(float(rng.choice([1.0, 1.0, rng.uniform(0.2, 1.0)])))
            with suppress(Refused):
                self._goes()
                self.motions += 1
            if rng.random() < 0.2:
                self._step(int(rng.integers(1, 200)))
                controller.stop()
            while controller.moving:
                self._step(1)
            if self._part is not None:
                assert controller.handling is not None
                assert controller.handling.holds
        return self

    def _goes(self) -> None:
        rng, controller, description = self._rng, self.controller, self._description
        low, high = np.array(description.position_min), np.array(description.position_max)
        here = np.array(controller.joints)
        target = here + rng.choice([0.1, 0.5, 1.0]) * (rng.uniform(low, high) - here)
        speeds = [float(rng.choice([1.0, rng.uniform(0.3, 1.0)]))] * len(low)
        how = rng.random()
        if how < 0.3:
            frame = controller.tool_frame()
            way = rng.uniform(-150.0, 150.0, 3).tolist()
            goal = frame._replace(
                x_mm=frame.x_mm + way[0], y_mm=frame.y_mm + way[1], z_mm=frame.z_mm + way[2]
            )
            controller.move(lin_move(goal, speeds[0], 0.0))
        elif how < 0.8:
            controller.move(joint_move(target.tolist(), speeds))
        else:
            kind = smart_joint_move if how < 0.9 else direct_joint_move
            controller.move(kind(target.tolist(), speeds))

    def _step(self, ticks: int) -> None:
        for _ in range(ticks):
            self.controller.step()


def free(seed: int) -> dict[str, float]:
    """How many motions did not stop themselves; `tools/hunt.py` tries more seeds."""
    scene = FreeScene(seed).run()
    assert scene.stops == [], scene.stops
    return {"motions": scene.motions}


@settings(max_examples=some(120), deadline=None)
@given(st.integers(0, 10**6))
@example(22)  # a part of 4 kg, 0.3 m from the centre of a tool
def test_no_free_motion_stops_itself_whatever_the_arm_carries(seed: int) -> None:
    free(seed)
