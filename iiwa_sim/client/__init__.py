"""Clients for drivers and tests: one method per command of the iiwa's line protocol, or per KRC4 message.

    with Iiwa("127.0.0.1", 30000) as robot:
        robot.lin_move((600, 0, 500, 3.14159, 0, 3.14159), speed=0.5, blending=0)
        robot.wait_until_stopped(timeout_s=10)
        print(robot.get_joint_position())

    async with AsyncIiwa("127.0.0.1", 30000) as robot:  # the same, to be awaited
        await robot.hello()

Methods are called as the commands of protocol/iiwa.toml, and its units hold: mm, rad, N, Nm, speeds relative
to the limits (1e-6 <= speed <= 1). `target` is x y z (mm, base frame) alpha beta gamma (rad, intrinsic
Z-Y-X), as a Frame holds it.

    with Krc4("127.0.0.1", 54600) as robot:  # axes=7 for an iiwa; AsyncKrc4 to be awaited
        robot.lin((445, 0, 700, 180, 0, 180))
        robot.wait_until_stopped(timeout_s=10)
        print(robot.goa())

Its methods are called as the messages of docs/krc4.md, in mm and degrees: `target` is X Y Z A B C, as a
Krc4Frame holds it. What the robot refuses raises Krc4Error, a CommandError with the `code` of the reply.

All of them need nothing of the simulator and work with any server of the protocol.
"""

from iiwa_sim.client._generated.async_iiwa import AsyncIiwa
from iiwa_sim.client._generated.async_krc4 import AsyncKrc4
from iiwa_sim.client._generated.iiwa import Iiwa
from iiwa_sim.client._generated.krc4 import Krc4
from iiwa_sim.client.errors import CommandError, Krc4Error, ReplyError, UnknownCommandError
from iiwa_sim.client.replies import (
    CartesianForce,
    CollisionThresholds,
    Frame,
    JointPosition,
    JointTorque,
    Krc4Frame,
    LastError,
    Reachability,
    RobotStatus,
    ToolLoad,
)

__all__ = [
    "AsyncIiwa",
    "AsyncKrc4",
    "CartesianForce",
    "CollisionThresholds",
    "CommandError",
    "Frame",
    "Iiwa",
    "JointPosition",
    "JointTorque",
    "Krc4",
    "Krc4Error",
    "Krc4Frame",
    "LastError",
    "Reachability",
    "ReplyError",
    "RobotStatus",
    "ToolLoad",
    "UnknownCommandError",
]
