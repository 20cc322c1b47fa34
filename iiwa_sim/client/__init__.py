"""Clients for drivers and tests: `Iiwa` for the text protocol, `Krc4` for KRC4 messages.

    with Iiwa("127.0.0.1", 30000) as robot:
        robot.lin_move((600, 0, 500, 3.14159, 0, 3.14159), speed=0.5, blending=0)
        robot.wait_until_stopped(timeout_s=10)
        print(robot.get_joint_position())

    with Krc4("127.0.0.1", 54600) as robot:  # axes=7 for an iiwa
        robot.lin((445, 0, 700, 180, 0, 180))
        robot.wait_until_stopped(timeout_s=10)
        print(robot.goa())

They need nothing of the simulator and work with any server of the protocol.
"""

# ruff: noqa: I001 - several lines for a module with many names
from iiwa_sim.client.iiwa import Iiwa as Iiwa
from iiwa_sim.client.krc4 import Krc4 as Krc4
from iiwa_sim.client.replies import CartesianForce as CartesianForce, CommandError as CommandError
from iiwa_sim.client.replies import Frame as Frame, Krc4Error as Krc4Error, Krc4Frame as Krc4Frame
from iiwa_sim.client.replies import LastError as LastError, ReplyError as ReplyError
from iiwa_sim.client.replies import RobotStatus as RobotStatus, UnknownCommandError as UnknownCommandError
