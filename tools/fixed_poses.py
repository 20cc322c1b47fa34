"""Write `fixed_poses.toml` of the robots that come along: `python -m tools.fixed_poses`, with Pinocchio."""

from pathlib import Path

from iiwa_sim.robot.description import built_in_robots, load_robot
from iiwa_sim.robot.fixed_poses import read_fixed_poses
from iiwa_sim.robot.found_poses import POSES_FILE, FoundPoses, poses_checksum, written

ROBOTS = Path(__file__).parent.parent / "robots"


def text_for(name: str) -> str:
    """What belongs into the file of this robot."""
    robot = load_robot(name)
    poses = read_fixed_poses(robot)
    of = poses_checksum(robot.urdf, robot.joints, robot.flange, poses)
    return written(FoundPoses(of, poses))


if __name__ == "__main__":
    for robot_name in built_in_robots():
        (ROBOTS / robot_name / POSES_FILE).write_text(text_for(robot_name))
