"""Clients for drivers and tests: one method per command of the iiwa's line protocol.

    with Iiwa("127.0.0.1", 30000) as robot:
        robot.lin_move((600, 0, 500, 3.14159, 0, 3.14159), speed=0.5, blending=0)
        robot.wait_until_stopped(timeout_s=10)
        print(robot.get_joint_position())

    async with AsyncIiwa("127.0.0.1", 30000) as robot:  # the same, to be awaited
        await robot.hello()

Methods are called as the commands of protocol/iiwa.toml, and its units hold: mm, rad, N, Nm, speeds relative
to the limits (0 < speed <= 1). `target` is x y z (mm, base frame) alpha beta gamma (rad, intrinsic Z-Y-X), as
a Frame holds it. They need nothing of the simulator and work with any server of the protocol.
"""

from iiwa_sim.client.async_commands import AsyncIiwa
from iiwa_sim.client.commands import Iiwa
from iiwa_sim.client.faults import CommandError, ReplyError, UnknownCommandError
from iiwa_sim.client.replies import (
    CartesianForce,
    Frame,
    JointPosition,
    JointTorque,
    LastError,
    Reachability,
    RobotStatus,
)

__all__ = [
    "AsyncIiwa",
    "CartesianForce",
    "CommandError",
    "Frame",
    "Iiwa",
    "JointPosition",
    "JointTorque",
    "LastError",
    "Reachability",
    "ReplyError",
    "RobotStatus",
    "UnknownCommandError",
]
