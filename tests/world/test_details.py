"""The details of MuJoCo that iiwa_sim/world relies on: a new version that changes one of them fails here."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mujoco as mj
import numpy as np
import pytest

from iiwa_sim.world import details
from iiwa_sim.world.material import law_of_free, law_of_imposed

H, G, K = 0.002, 9.81, 1e5
LAW = law_of_free(H)
SLEEP = int(mj.mjtEnableBit.mjENBL_SLEEP)


class Scene:
    """Two boxes of 1 kg on a floor, and one high above it."""

    def __init__(self, sleep: bool = True) -> None:
        spec = mj.MjSpec()
        spec.option.timestep, spec.option.gravity = H, [0.0, 0.0, -G]
        spec.option.cone, spec.option.integrator = mj.mjtCone.mjCONE_ELLIPTIC, mj.mjtIntegrator.mjINT_EULER
        spec.option.enableflags |= SLEEP if sleep else 0
        law = {"solref": LAW.solref, "solimp": LAW.solimp, "margin": 1e-4, "friction": [0.5, 0.0, 0.0]}
        kinds, floor = mj.mjtGeom, spec.worldbody.add_body(name="floor", gravcomp=1.0)
        bits = {"contype": details.SURFACES, "conaffinity": details.PARTS + details.PASSING}
        floor.add_geom(type=kinds.mjGEOM_BOX, size=[1.0, 1.0, 0.1], pos=[0.0, 0.0, -0.1], **law, **bits)
        for number, z in enumerate((0.05, 0.05, 5.0)):
            body = spec.worldbody.add_body(name=f"{number}", pos=[0.3 * number, 0.0, z])
            body.add_freejoint()
            bits = {"contype": details.PARTS, "conaffinity": details.ALL}
            body.add_geom(type=kinds.mjGEOM_BOX, size=[0.05] * 3, mass=1.0, **law, **bits)
        self.model: Any = spec.compile()
        self.data: Any = mj.MjData(self.model)
        for at in range(1, 5):
            details.soften(self.model, at, K, LAW)
        self.points = np.full(self.model.ngeom, 4, np.intc)
        self.stands = np.array([1, 0, 0, 0], np.int8)

    def find(self) -> None:
        details.find_forces(self.model, self.data, self.points, self.stands, 0.002)

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            mj.mj_Euler(self.model, self.data)
            self.find()


def test_invweight_is_a_compliance_in_contacts_and_contacts_of_a_pair_follow_each_other() -> None:
    scene = Scene(sleep=False)
    scene.find()
    scene.step(500)
    assert 0.05 - scene.data.qpos[2] == pytest.approx(G / (0.5 * K), rel=1e-3)
    pairs = scene.data.contact.geom.tolist()
    assert len([1 for a, b in pairwise(pairs) if a != b]) == 1


def test_forces_belong_to_the_positions_of_this_tick_and_follow_a_changed_law() -> None:
    scene = Scene(sleep=False)
    details.set_imposed(scene.model, 2, np.full(6, 1e3))
    details.set_law(scene.model, 1, law_of_imposed(LAW), 2)
    for deep in (1e-4, 5e-4, 2e-4):
        scene.data.qpos[2], scene.data.qvel[:6] = 0.05 - deep, 0.0
        scene.find()
        assert scene.data.qfrc_constraint[2] == pytest.approx(0.5 * K * deep, rel=1e-3)


def test_dof_m0_makes_a_free_body_heavy_and_gravcomp_weightless() -> None:
    scene = Scene(sleep=False)
    details.set_imposed(scene.model, 4, np.full(6, 1e3))
    scene.data.qfrc_applied[12] = 1e3
    scene.find()
    assert scene.data.qacc[12:15] == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)
    details.set_free(scene.model, scene.data, 4, np.full(6, 1.0))
    scene.find()
    assert scene.data.qacc[12:15] == pytest.approx((0.0, 0.0, -G), abs=1e-9)


def test_a_resting_body_sleeps_without_contacts_and_is_woken() -> None:
    scene = Scene()
    details.set_gone(scene.model, scene.data, 4, 3)
    scene.find()
    scene.step(300)
    assert details.is_quiet(scene.data, 0)
    details.wake_all(scene.model, scene.data)
    scene.find()
    assert scene.data.ntree_awake == 3
    assert scene.data.ncon == 8
