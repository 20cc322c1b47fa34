"""The TCP of a robot with one tool: where it is, and its Jacobian, by Pinocchio."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from iiwa_sim.frames import Transform

_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Tcp:
    """A frame fixed to the flange. Joint positions are rad, base first; poses are in the base, in m.

    It remembers the last joint positions it was asked for: several ask for the same ones in a tick.
    """

    def __init__(self, model: pin.Model, flange: int, tool_in_flange: Transform) -> None:
        """`flange` is the index of the flange's frame in the model."""
        self.tool_in_flange = tool_in_flange
        with_tool = pin.Model(model)
        tool = pin.SE3(np.array(tool_in_flange.rotation).reshape(3, 3), np.array(tool_in_flange.translation))
        on = with_tool.frames[flange]
        placement = on.placement * tool
        self._frame = with_tool.addFrame(
            pin.Frame("iiwa_sim TCP", on.parentJoint, flange, placement, pin.FrameType.OP_FRAME)
        )
        self._model = with_tool
        self._data = with_tool.createData()
        self._q = np.zeros(with_tool.nq)
        # Views into the data, which every computation overwrites; fetching them anew costs more than it.
        pose = self._data.oMf[self._frame]
        self._rotation, self._translation = pose.rotation, pose.translation
        self._posed: tuple[float, ...] = ()
        self._pose = tool_in_flange
        self._moved: tuple[float, ...] = ()
        self._jacobian = np.zeros((6, with_tool.nv))

    def pose(self, q: Sequence[float]) -> Transform:
        """Where it is."""
        if q != self._posed:
            self._q[:] = q
            pin.forwardKinematics(self._model, self._data, self._q)
            pin.updateFramePlacement(self._model, self._data, self._frame)
            self._read(q)
        return self._pose

    def jacobian(self, q: Sequence[float]) -> NDArray[np.float64]:
        """Its Jacobian (6, n): velocity (m/s), then angular velocity (rad/s), in base axes; not to be
        changed."""
        if q != self._moved:
            self._q[:] = q
            self._jacobian = pin.computeFrameJacobian(
                self._model, self._data, self._q, self._frame, _ALIGNED
            )  # a new one every time
            self._moved = tuple(q)
            if q != self._posed:
                self._read(q)  # it has found the pose, too
        return self._jacobian

    def _read(self, q: Sequence[float]) -> None:
        (r0, r1, r2), (r3, r4, r5), (r6, r7, r8) = self._rotation.tolist()
        x, y, z = self._translation.tolist()
        self._pose = Transform((r0, r1, r2, r3, r4, r5, r6, r7, r8), (x, y, z))
        self._posed = tuple(q)
