"""The bodies of a cell: parts, and the gripper that works with them. MuJoCo moves what moves freely.

The motion of the arm is imposed on the bodies: it stays exactly on its plan, and feels the forces that
contacts make. `world.World` is loaded by a cell with parts only, since it imports MuJoCo. Everything here is
stepped, without sockets, threads, wall clock or log.
"""
