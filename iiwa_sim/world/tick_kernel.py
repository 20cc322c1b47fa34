"""Loops of each tick of the bodies: corrections of contacts, distances that the arm has gone."""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
from cython.cimports.iiwa_sim.contact.tcp_contact_kernel import Contact, Gaps, TcpContact
from cython.cimports.iiwa_sim.robot.arm_kernel import Tcp
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.payload import GRAVITY_M_S2
from iiwa_sim.frames import Transform
from iiwa_sim.motion.joints import Joints

BASE = 2
"""Number of contact points that share the stiffness of two bodies before their count is known.
With 2, one point is stable for the lightest body, and eight are not too slow."""
OF_PART, STANDS, OF_ARM, OF_SCENE = 0, 1, 2, 3
"""Kinds of geoms: of a part, fixed to the world, of an arm, or of a scene's body that moves."""
_STANDS = cython.declare(cython.int, STANDS)
_OF_SCENE = cython.declare(cython.int, OF_SCENE)
_BASE = cython.declare(cython.double, BASE)
ROOM_M = 1e-3
"""Contacts are computed where an arm is closer than this to something."""
_ROOM = cython.declare(cython.double, ROOM_M)
_NEAR = cython.declare(cython.double, 0.02)  # nearer than this (m) bounding spheres will not do
# Friction of imposed bodies is Coulomb's above some mm/s, by this factor of MuJoCo's acceleration.
_RUBS = cython.declare(cython.double, 1e3)
IMPRATIO = 100.0
"""Compliance of the normal force over that of friction, as MuJoCo has it."""
_IMPRATIO = cython.declare(cython.double, IMPRATIO)
# Free bodies that are slower creep (m/s, rad/s).
_CREEPS_M_S = cython.declare(cython.double, 0.02)
_CREEPS_RAD_S = cython.declare(cython.double, 1.0)
_GRAVITY = cython.declare(cython.double, GRAVITY_M_S2)
# Friction may always ask for this deceleration (m/s2).
_BRAKES = cython.declare(cython.double, 1.5 * GRAVITY_M_S2)


def correct(
    aref: cython.double[::1],
    pos: cython.double[::1],
    law: cython.double[:, ::1],
    geom: cython.int[:, :],
    address: cython.int[:],
    dim: cython.int[:],
    margin: cython.double[:],
    friction: cython.double[:, :],
    points: cython.int[::1],
    kinds: cython.char[::1],
    tick_s: cython.double,
) -> None:
    """Correct the reference accelerations of contacts before the solver uses them.

    All contact points of two bodies together have the stiffness of the two in series, for any number of
    points; those of one pair follow each other. Friction asks for no greater deceleration than it can
    give, or 1.5 g: MuJoCo's contact is convex, so a body that slides fast would be pressed up, lifted off,
    and rattle. With the cap it is lifted by less than the margin, in which the contact is still there and
    presses by damping only. Imposed bodies press on standing ones by k d alone, and rub by Coulomb's law.

    `points` has for each geom the least number of points in which it rests, 1, 2 or 4; `kinds` its kind.
    """
    n: cython.Py_ssize_t = geom.shape[0]
    c: cython.Py_ssize_t = 0
    while c < n:
        a: cython.int = geom[c, 0]
        b: cython.int = geom[c, 1]
        end: cython.Py_ssize_t = c + 1
        while end < n and geom[end, 0] == a and geom[end, 1] == b:
            end += 1
        both: cython.int = kinds[a] + kinds[b]
        if max(kinds[a], kinds[b]) == _OF_SCENE and both > _OF_SCENE:
            c = end  # a body of the scene on another, or on an arm, as the scene has it
            continue
        still: cython.bint = kinds[a] == _STANDS or kinds[b] == _STANDS or both > _OF_SCENE
        least: cython.int = min(points[a], points[b])
        share: cython.double = _BASE / max(end - c, least)
        root: cython.double = sqrt(share)
        for k in range(c, end):
            row: cython.Py_ssize_t = address[k]
            if row < 0:
                continue
            spring: cython.double = law[row, 0] * law[row, 2]
            deep: cython.double = -spring * pos[row]
            imposed: cython.bint = law[row, 2] < 0.5
            if imposed and still:  # nothing moves by these forces
                aref[row] = share * deep
                if dim[k] > 1:
                    slides: cython.double = sqrt(aref[row + 1] ** 2 + aref[row + 2] ** 2)
                    most: cython.double = friction[k, 0] * max(share * deep, 0.0) / _IMPRATIO
                    rubs: cython.double = most / slides if _RUBS * slides > most else _RUBS
                    for i in range(1, dim[k]):
                        aref[row + i] *= rubs
                continue
            damped: cython.double = aref[row] + spring * (pos[row] - margin[k])
            if imposed:  # a free part would swing on that spring
                aref[row] = share * (deep + 0.5 * tick_s * spring * damped / law[row, 1])
            else:
                aref[row] = share * deep + root * damped
            if dim[k] > 1:
                can: cython.double = friction[k, 0] * max(share * deep, _BRAKES)
                x: cython.double = aref[row + 1]
                y: cython.double = aref[row + 2]
                asked: cython.double = sqrt(x * x + y * y)
                if asked > can:
                    aref[row + 1] = x * can / asked
                    aref[row + 2] = y * can / asked
        c = end


@cython.cfunc
@cython.exceptval(-2.0)
def _advance(
    joints: Joints, pose: cython.p_double, b: cython.double[::1], jaw_m: cython.double, if_away: cython.bint
) -> cython.double:
    """Advance, with the pose as 12 numbers; `if_away`, return -1 at once where bounds leave no room."""
    n: cython.Py_ssize_t = (b.shape[0] - 19) // 2
    far: cython.double = 0.0
    turned: cython.double = 0.0
    moved: cython.double = 0.0
    now: cython.double
    for k in range(n):
        now = joints[k]
        far += fabs(now - b[19 + n + k]) * b[19 + k]
    for k in range(12 if far > 0.0 else 0):
        now = pose[k] - b[7 + k]
        turned, moved = turned + (now * now if k < 9 else 0.0), moved + (now * now if k >= 9 else 0.0)
    tcp_m: cython.double = sqrt(moved) + jaw_m
    turned = sqrt(0.5 * turned)
    tool: cython.double = tcp_m + b[6] * turned
    if if_away and min(b[0] - far, b[1] - tool, b[2] - max(far, tool)) < _ROOM:
        return -1.0
    for k in range(n):
        b[19 + n + k] = joints[k]
    for k in range(12):
        b[7 + k] = pose[k]
    b[0], b[1], b[2] = b[0] - far, b[1] - tool, b[2] - max(far, tool)
    b[3], b[4], b[5] = far, tcp_m, turned
    return far + jaw_m


def advance(joints: Joints, tcp: Transform, b: cython.double[::1], jaw_m: cython.double) -> float:
    """Lower the bounds of distances of an arm by its motion in a tick; return how far (m) links or jaws go.

    `b` begins with bounds (m) of links, of what moves with the gripper, and of both from other arms. Then
    follow motions of links (m), of TCP and jaws (m) and of the TCP (rad), and the reach (m) of its load. The
    pose of the TCP is next; then the greatest lever (m) of each joint, and its position (rad).
    """
    pose = cython.declare(cython.double[12])
    for k in range(12):
        pose[k] = tcp[0][k] if k < 9 else tcp[1][k - 9]
    return float(_advance(joints, pose, b, jaw_m, False))


def leave_out(
    ahead: list[Joints],
    made: cython.Py_ssize_t,
    tick: cython.long,
    tick_s: cython.double,
    tcp: Tcp,
    surfaces: TcpContact,
    gaps: Gaps,
    carried: cython.double[::1],
    most_n: cython.double,
    most_nm: cython.double,
    bounds: cython.double[::1],
) -> int:
    """Return how many ticks after number `tick` need not be computed.

    Nothing is near the arm in these and the next one, and its load acts on the TCP with at most `most_n` and
    `most_nm`. Joint positions `ahead` are those of now and of coming ticks; `made` of them are done.
    `carried` are mass (kg), first (kg m) and second moments (kg m2). Bounds are lowered, as by `advance`.
    """
    poses = cython.declare(cython.double[36])
    contact: Contact
    for k in range(made, len(ahead)):
        before: cython.p_double = poses + 12 * ((k - 2) % 3)
        at: cython.p_double = poses + 12 * ((k - 1) % 3)
        after: cython.p_double = poses + 12 * (k % 3)
        tcp.go_to(ahead[k])
        for i in range(12):
            after[i] = tcp.turned[i] if i < 9 else tcp.place[i - 9]
        free: cython.bint = True
        for contact in surfaces._contacts.values():
            if k > made and not contact.is_free(after[9], after[10], after[11]):
                free, contact._free[3] = False, 0.0  # it is to be looked at
        if free and k < made + 2:
            continue
        if not (free and gaps.is_free(ahead[k - 1], tick + k - 1, tick_s)):
            break
        turns: cython.double = 0.0
        pushes: cython.double = 0.0
        for i in range(12):
            bend: cython.double = after[i] - 2.0 * at[i] + before[i]
            turns, pushes = turns + (bend * bend if i < 9 else 0.0), pushes + (bend * bend if i >= 9 else 0.0)
        turns = sqrt(turns) / (tick_s * tick_s)
        pushes = 1.5 * sqrt(pushes) / (tick_s * tick_s) + _GRAVITY
        if carried[0] * pushes + carried[1] * turns > most_n:
            break
        if carried[1] * pushes + 1.5 * carried[2] * turns > most_nm:
            break
        if _advance(ahead[k - 1], at, bounds, 0.0, True) < 0.0:
            break
        made = k - 1
    return int(made)


def nearest(
    places: cython.double[:, :], one: cython.long[::1], two: cython.long[::1], reach: cython.double[:, ::1]
) -> tuple[float, list[tuple[int, int]]]:
    """Return the least distance (m) of balls that are not near, or 1, and near pairs; `reach` is of both."""
    least: cython.double = 1.0
    near = []
    for i in range(one.shape[0]):
        for k in range(two.shape[0]):
            square: cython.double = 0.0
            for j in range(3):
                off: cython.double = places[one[i], j] - places[two[k], j]
                square += off * off
            apart: cython.double = sqrt(square) - reach[i, k]
            if apart < _NEAR:
                near.append((one[i], two[k]))
            else:
                least = min(least, apart)
    return least, near


def brake(v: cython.double[:, ::1], tick_s: cython.double) -> float:
    """Brake free bodies that creep, which rolling friction hardly does; returns their greatest rad/s."""
    fastest: cython.double = 0.0
    for i in range(v.shape[0]):
        turns: cython.double = max(fabs(v[i, 3]), fabs(v[i, 4]), fabs(v[i, 5]))
        pace: cython.double = max(fabs(v[i, 0]), fabs(v[i, 1]), fabs(v[i, 2])) / _CREEPS_M_S
        pace = max(pace, turns / _CREEPS_RAD_S, 1e-9)
        kept: cython.double = max(0.0, 1.0 - tick_s * (1.0 + 1.0 / pace)) if pace < 1.0 else 1.0
        fastest = max(fastest, turns)
        for k in range(6):
            v[i, k] *= kept
    return float(fastest)


def measure_free(
    q: cython.double[:, ::1], v: cython.double[:, ::1], was: cython.double[:, ::1], near_m: cython.double
) -> tuple[bool, float, float]:
    """Return True if free bodies are near where they were, with their greatest speed and coordinate (m)."""
    off: cython.double = 0.0
    speed: cython.double = 0.0
    far: cython.double = 0.0
    for i in range(q.shape[0]):
        for k in range(7):
            off = max(off, fabs(q[i, k] - was[i, k]) * (1.0 if k < 3 else 0.1))
        for k in range(3):
            far = max(far, fabs(q[i, k]))
            speed = max(speed, fabs(v[i, k]), fabs(v[i, 3 + k]))
    return off <= near_m, speed, far
