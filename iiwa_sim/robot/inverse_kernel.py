"""The closed forms of all arms: for one pose, for many, and for other kernels.

`kind` selects the closed form, `numbers` are the dimensions of the arm: see `iiwa_sim.robot.inverse.Inverse`.
"""

# mypy: allow-untyped-decorators

from typing import Any

import cython

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.opw_kernel import solve as solve_opw
    from cython.cimports.iiwa_sim.robot.srs_kernel import solve as solve_srs
else:
    from iiwa_sim.robot.opw_kernel import solve as solve_opw
    from iiwa_sim.robot.srs_kernel import solve as solve_srs

SRS = 0
OPW = 1
_OPW = cython.declare(cython.int, 1)

REGULAR = 0
NEAR = 1
OUT_OF_REACH = 2


@cython.ccall
@cython.exceptval(check=False)
def solve(
    kind: cython.int,
    numbers: cython.double[::1],
    poses: cython.double[:, ::1],
    row: cython.Py_ssize_t,
    redundancy: cython.double,
    status: cython.int,
    seed: cython.double[::1],
    aligned: cython.double,
    joints: cython.double[:, ::1],
) -> cython.int:
    """See `iiwa_sim.robot.srs_kernel.solve`."""
    if kind == _OPW:
        return solve_opw(numbers, poses, row, redundancy, status, seed, aligned, joints)
    return solve_srs(numbers, poses, row, redundancy, status, seed, aligned, joints)


def solve_rows(
    kind: cython.int,
    numbers: cython.double[::1],
    poses: cython.double[:, ::1],
    redundancies: cython.double[::1],
    statuses: cython.longlong[::1],
    seed: cython.double[::1],
    aligned: cython.double,
    joints: cython.double[:, ::1],
    results: cython.schar[::1],
) -> None:
    """Write the joint positions (rad) for each row of `poses` (N, 12: rotation, position in m) to `joints`
    (N, n).

    `results` (N,) tell whether a row is `REGULAR`, `NEAR` a singular pose, or `OUT_OF_REACH` and not written.
    """
    for row in range(poses.shape[0]):
        results[row] = solve(
            kind, numbers, poses, row, redundancies[row], statuses[row], seed, aligned, joints
        )


def solve_one(
    kind: cython.int,
    numbers: cython.double[::1],
    rotation: Any,
    place: Any,
    redundancy: cython.double,
    status: cython.int,
    seed: Any,
    aligned: cython.double,
    room: cython.double[:, ::1],
) -> Any:
    """A result as in `solve_rows`, and a tuple of joint positions (rad), for one pose of the flange.

    Rotation (9), position (3, m) and seed (n) are sequences. `room` (3, 12) is scratch space.
    """
    for k in range(9):
        room[0, k] = rotation[k]
    for k in range(3):
        room[0, 9 + k] = place[k]
    count: cython.Py_ssize_t = len(seed)
    for k in range(count):
        room[1, k] = seed[k]
    result: cython.int = solve(kind, numbers, room, 0, redundancy, status, room[1], aligned, room[2:])
    return result, tuple([room[2, k] for k in range(count)])
