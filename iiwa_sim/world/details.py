"""Details of MuJoCo that the bodies rely on, each in one function, tested in tests/world/test_details.py."""

from __future__ import annotations

from typing import Any

import mujoco as mj
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.world.material import Law
from iiwa_sim.world.tick_kernel import BASE, correct

Vector = NDArray[np.float64]
PARTS, SURFACES, PASSING = 1, 2, 4
"""Collision bits, beside one of each arm: parts meet everything, surfaces parts, arms parts and other arms.
A part that passes meets neither the arm that holds it nor, until it is out of it, one that has let it go."""
ALL = 0x7FFFFFFF
ARMS = ALL - PARTS - SURFACES - PASSING
_SLEEP = int(mj.mjtEnableBit.mjENBL_SLEEP)


def arm_bit(number: int) -> int:
    """Return the collision bit of an arm: there are 28."""
    return 2 * PASSING << number


def soften(model: Any, body: int, stiffness_n_per_m: float, law: Law) -> None:
    """Give a body its stiffness in each contact: there `body_invweight0` only scales the compliance."""
    model.body_invweight0[body, 0] = law.scale * BASE / stiffness_n_per_m


def find_forces(
    model: Any, data: Any, points: NDArray[np.intc], kinds: NDArray[np.int8], tick_s: float
) -> None:
    """Compute what `mj_forward` does, with corrected contacts.

    `mj_fwdVelocity` finds `efc_aref`, by the law in `efc_KBIP`; the solver reads it later.
    """
    mj.mj_fwdPosition(model, data)
    if model.nsensor:
        mj.mj_sensorPos(model, data)
    mj.mj_fwdVelocity(model, data)
    if data.ncon:
        c, law = data.contact, data.efc_KBIP.reshape(-1, 4)
        rows = c.geom, c.efc_address, c.dim, c.includemargin, c.friction
        correct(data.efc_aref, data.efc_pos, law, *rows, points, kinds, tick_s)
    mj.mj_fwdActuation(model, data)
    mj.mj_fwdAcceleration(model, data)
    mj.mj_fwdConstraint(model, data)
    if model.nsensor:
        mj.mj_sensorVel(model, data)
        mj.mj_rnePostConstraint(model, data)  # needed by `force` sensors only
        mj.mj_sensorAcc(model, data)


def set_law(model: Any, geom: int, law: Law, priority: int) -> None:
    """Give a geom a contact law; that of the geom with the greater priority counts."""
    model.geom_solref[geom], model.geom_solimp[geom] = law.solref, law.solimp
    model.geom_priority[geom] = priority


def set_imposed(model: Any, body: int, inertia: Vector) -> None:
    """Give a part's dofs an inertia and no weight: of free bodies with aligned inertia MuJoCo reads `dof_M0`.

    The part stays awake. `body_gravcomp` counts at run time if a body has had one when the model was
    compiled, as arms have.
    """
    first = int(model.body_dofadr[body])
    model.dof_M0[first : first + 6], model.body_gravcomp[body] = inertia, 1.0
    never_sleeps(model, body)


def set_free(model: Any, data: Any, body: int, inertia: Vector) -> None:
    """Let a part move freely."""
    first = int(model.body_dofadr[body])
    model.dof_M0[first : first + 6], model.body_gravcomp[body] = inertia, 0.0
    model.tree_sleep_policy[model.body_treeid[body]] = mj.mjtSleepPolicy.mjSLEEP_ALLOWED
    data.qfrc_applied[first : first + 6] = 0.0


def set_passed(model: Any, geom: int, arms: int) -> None:
    """Have a part meet all but the arms of these bits."""
    model.geom_contype[geom], model.geom_conaffinity[geom] = PASSING if arms else PARTS, ALL - arms


def set_gone(model: Any, data: Any, body: int, geom: int) -> None:
    """Have a part meet nothing, and stay where it is."""
    first = int(model.body_dofadr[body])
    model.geom_contype[geom] = model.geom_conaffinity[geom] = 0
    model.body_gravcomp[body] = 1.0
    data.qvel[first : first + 6] = data.qacc[first : first + 6] = 0.0


def never_sleeps(model: Any, body: int) -> None:
    """Keep the kinematic tree of a body awake: `tree_sleep_policy` is read at run time."""
    model.tree_sleep_policy[model.body_treeid[body]] = mj.mjtSleepPolicy.mjSLEEP_NEVER


def wake_all(model: Any, data: Any) -> None:
    """Wake all bodies, and place surfaces anew.

    A force on a body wakes it; there is no call for that. With sleep, static bodies are placed only once, so
    they are placed without it.
    """
    forces = data.xfrc_applied.copy()
    data.xfrc_applied[:, 2] += 1e-9
    mj.mj_fwdPosition(model, data)
    data.xfrc_applied[:] = forces
    flags = model.opt.enableflags
    model.opt.enableflags &= ~_SLEEP
    mj.mj_fwdPosition(model, data)
    model.opt.enableflags = flags


def is_quiet(data: Any, imposed: int) -> bool:
    """Return True if nothing touches, and all but so many imposed trees sleep, which end contacts."""
    return bool(data.ncon == 0 and data.ntree_awake <= imposed)
