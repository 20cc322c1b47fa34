"""One robot in the scene: draws the states it is given, and knows nothing of where they come from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from iiwa_sim.frames import Frame, Transform, Vector, compose, inverse
from iiwa_sim.view.arm import Arm
from iiwa_sim.view.drawing import Drawing, wxyz
from iiwa_sim.view.jaws import Jaws
from iiwa_sim.view.parts import Parts
from iiwa_sim.view.surfaces import Surfaces, touched
from iiwa_sim.view.tool import Tool
from iiwa_sim.view.trail import Trail

if TYPE_CHECKING:
    import viser

State = Mapping[str, Any]
"""A state of the robot, with the keys and units of protocol/status.schema.json."""

FORCE_SHOWN_N = 0.5
TORQUE_SHOWN_NM = 0.1
M_PER_N = 0.005
M_PER_NM = 0.02
LONGEST_ARROW_M = 0.5
GHOST_SHOWN_RAD = 0.01
_SHOWN = (
    "joint_position",
    "goal_joint_position",
    "flange_frame",
    "tool_frame",
    "cartesian_force",
    "status",
    "gripper",
    "link_touches",
    "parts",
)
MOST_MARKS = 4
"""Contacts that are marked at once."""


class Scene:
    """Arm, tool, jaws, parts, frames, path, wrench, contacts, ghost of the goal, below a node."""

    def __init__(
        self,
        scene: viser.SceneApi,
        drawing: Drawing,
        root: str = "/robot",
        place_m: Vector = (0.0, 0.0, 0.0),
    ) -> None:
        """`place_m` is where its base stands in the scene."""
        self.drawing = drawing
        self.root = root
        self.place_m = place_m
        scene.add_frame(root, show_axes=False, position=place_m)
        self._goal: Any = scene.add_frame(f"{root}/goal", show_axes=False, visible=False)
        self.arm = Arm(scene, drawing, f"{root}/arm")
        self.ghost = Arm(scene, drawing, f"{root}/goal", ghost=True)
        self.surfaces = Surfaces(scene, f"{root}/cell")
        self.contact_radius_m = 0.0
        scene.add_frame(f"{root}/base", axes_length=0.15, axes_radius=0.004)
        self._tcp: Any = scene.add_frame(f"{root}/tcp", axes_length=0.08, axes_radius=0.003)
        self._jaws = Jaws(scene, f"{root}/tcp")
        self._parts = Parts(scene, f"{root}/parts")
        self._force = _arrow(scene, f"{root}/tcp/force", (230, 90, 20))
        self._torque = _arrow(scene, f"{root}/tcp/torque", (150, 60, 200))
        flange = self.arm.paths[drawing.flange]
        self._tool_body = Tool(scene, flange)
        self._tool: Any = scene.add_line_segments(
            f"{flange}/tool",
            np.zeros((1, 2, 3), np.float32),
            np.full((1, 2, 3), 90, np.uint8),
            thickness=5.0,
            thickness_units="screen",
        )
        self._tool_mm: tuple[float, ...] = ()
        self._marks: list[Any] = [
            scene.add_icosphere(f"{root}/contact/{number}", radius=0.015, color=(230, 30, 30), visible=False)
            for number in range(MOST_MARKS)
        ]
        self._trail = Trail(scene, f"{root}/trail")
        self._shown: tuple[Any, ...] = ()

    def show(self, state: State) -> None:
        """Draw a state. Where its `time_s` is before that of the last one, the path begins anew."""
        shown = tuple(state.get(key) for key in _SHOWN)  # in recordings there may be no gripper, no parts
        if shown == self._shown:
            self._trail.rest(state["time_s"])
            return
        self._shown = shown
        joints = state["joint_position"]
        flange, tcp = Frame(*state["flange_frame"]).to_transform(), Frame(*state["tool_frame"]).to_transform()
        self.arm.show(joints)
        self._tcp.position, self._tcp.wxyz = tcp.translation, wxyz(tcp.rotation)
        self._show_tool(compose(inverse(flange), tcp))
        self._trail.add(state["time_s"], tcp.translation)
        self._jaws.show(state.get("gripper"))
        self._parts.show(state.get("parts", ()))
        self._show_goal(state)
        wrench = state["cartesian_force"]
        _show_arrow(self._force, wrench[:3], FORCE_SHOWN_N, M_PER_N)
        _show_arrow(self._torque, wrench[3:], TORQUE_SHOWN_NM, M_PER_NM)
        self._show_contacts(tcp.translation, state.get("link_touches", ()))

    def show_cell(self, cell: Mapping[str, Any]) -> None:
        """Draw what the backdoor's `get cell` tells."""
        self.contact_radius_m = 1e-3 * cell["contact_radius_mm"]
        self._shown = ()  # there may be contacts where there were none
        self._parts.are(cell.get("parts", ()))
        self._jaws.are(cell.get("jaw_mm", ()))
        self._tool_body.are(cell.get("tool_capsules", ()))
        self.surfaces.show(cell["surfaces"])

    def _show_tool(self, tool: Transform) -> None:
        shown = tuple(round(1e3 * each, 1) for each in tool.translation)
        if shown != self._tool_mm:
            self._tool_mm = shown
            self._tool.points = np.array([[(0.0, 0.0, 0.0), tool.translation]], np.float32)

    def _show_goal(self, state: State) -> None:
        goal, joints = state["goal_joint_position"], state["joint_position"]
        far = max(abs(a - b) for a, b in zip(goal, joints, strict=True)) > GHOST_SHOWN_RAD
        shown = far and state["status"] == "moving"
        if shown:
            self.ghost.show(goal)
        if self._goal.visible != shown:
            self._goal.visible = shown

    def _show_contacts(self, tcp: Vector, link_touches: Sequence[Mapping[str, Any]]) -> None:
        found = [*touched(self.surfaces.surfaces, self.contact_radius_m, tcp)]
        found += [(1e-3 * x, 1e-3 * y, 1e-3 * z) for x, y, z in (each["point"] for each in link_touches)]
        for number, mark in enumerate(self._marks):
            shown = number < min(len(found), MOST_MARKS)
            if shown:
                mark.position = found[number]
            if mark.visible != shown:
                mark.visible = shown


def _arrow(scene: viser.SceneApi, path: str, colour: tuple[int, int, int]) -> Any:
    points = np.array([[(0.0, 0.0, 0.0), (0.0, 0.0, 0.1)]], np.float32)
    return scene.add_arrows(
        path, points, colour, shaft_radius=0.006, head_radius=0.016, head_length=0.035, visible=False
    )


def _show_arrow(handle: Any, vector: tuple[float, ...], least: float, metres: float) -> None:
    size = float(np.linalg.norm(vector))
    shown = size >= least
    if shown:
        scale = min(metres, LONGEST_ARROW_M / size)
        end = np.round(scale * np.array(vector), 3)  # noise of less is not sent
        if not np.array_equal(handle.points[0][1], end.astype(np.float32)):
            handle.points = np.array([[(0.0, 0.0, 0.0), end]], np.float32)
    if handle.visible != shown:
        handle.visible = shown
