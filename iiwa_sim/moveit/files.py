"""The files by which MoveIt and ros2_control know a robot, as texts.

Their forms: https://moveit.picknik.ai, https://control.ros.org. What they say of limits is what the
robot keeps when it follows a trajectory, so that what is planned within them is not averaged.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from xml.sax.saxutils import quoteattr

from iiwa_sim.moveit.pairs import Pair
from iiwa_sim.robot.description import RobotDescription
from iiwa_sim.ros.arm.contents import STATES
from iiwa_sim.ros.arm.joint_level import ACTION, COMMANDS, CONTROLLER
from iiwa_sim.ros.arm.links import Links

GROUP = "arm"
RESAMPLED_S = 0.1
"""How far apart in time the points are that MoveIt's default timing makes (resample_dt)."""
OVERSHOOT = 0.075
"""Between two points a trajectory is a polynomial of degree 5. Where the acceleration jumps between them, as
it does in that timing, the joint is faster there than at both by at most this part of the greatest
acceleration times their distance in time: found by looking at all places of one or two jumps."""
LEAST_SPEED = 0.5
"""No joint is told less of its velocity limit than this part."""
UPDATE_HZ = 100


def files(robot: RobotDescription, pairs: Sequence[Pair]) -> dict[str, str]:
    """The text of each file, by its name; `pairs` are those that MoveIt does not compare."""
    return {
        "robot.urdf": robot.urdf,
        "robot.srdf": srdf(robot, pairs),
        "joint_limits.yaml": _joint_limits(robot),
        "kinematics.yaml": _kinematics(),
        "moveit_controllers.yaml": _moveit_controllers(robot),
        "ros2_control.urdf": _with_ros2_control(robot),
        "ros2_controllers.yaml": _ros2_controllers(robot),
    }


def srdf(robot: RobotDescription, pairs: Sequence[Pair]) -> str:
    """A group from the base to the flange, its home, and the pairs of links that need no comparison."""
    return "".join(f"{line}\n" for line in _srdf(robot, pairs))


def _srdf(robot: RobotDescription, pairs: Sequence[Pair]) -> Iterator[str]:
    base = Links(robot.urdf, robot.joints).base
    yield '<?xml version="1.0" encoding="utf-8"?>'
    yield f"<robot name={quoteattr(_name(robot))}>"
    yield f'  <group name="{GROUP}">'
    yield f"    <chain base_link={quoteattr(base)} tip_link={quoteattr(robot.flange)}/>"
    yield "  </group>"
    yield f'  <group_state name="home" group="{GROUP}">'
    for name, position in zip(robot.joints, robot.home, strict=True):
        yield f'    <joint name={quoteattr(name)} value="{position:.9g}"/>'
    yield "  </group_state>"
    for pair in pairs:
        links = f"link1={quoteattr(pair.first)} link2={quoteattr(pair.second)}"
        yield f'  <disable_collisions {links} reason="{pair.reason}"/>'
    yield "</robot>"


def _name(robot: RobotDescription) -> str:
    """The robot's name in its URDF: MoveIt wants the same in the SRDF."""
    return ET.fromstring(robot.urdf).get("name", "")


def _joint_limits(robot: RobotDescription) -> str:
    lines = [
        "default_velocity_scaling_factor: 1.0",
        "default_acceleration_scaling_factor: 1.0",
        "joint_limits:",
    ]
    rows = zip(robot.joints, robot.velocity, robot.direct_acceleration, robot.direct_jerk, strict=True)
    for name, fastest, acceleration, jerk in rows:
        velocity = max(fastest - OVERSHOOT * RESAMPLED_S * acceleration, LEAST_SPEED * fastest)
        lines.append(f"  {name}:")
        for kind, value in (("velocity", velocity), ("acceleration", acceleration), ("jerk", jerk)):
            lines += [f"    has_{kind}_limits: true", f"    max_{kind}: {value:.9g}"]
    return _yaml(lines)


def _kinematics() -> str:
    return _yaml(
        [
            f"{GROUP}:",
            "  kinematics_solver: kdl_kinematics_plugin/KDLKinematicsPlugin",
            "  kinematics_solver_search_resolution: 0.005",
            "  kinematics_solver_timeout: 0.05",
        ]
    )


def _moveit_controllers(robot: RobotDescription) -> str:
    controller = CONTROLLER.strip("/")
    manager = "moveit_simple_controller_manager"
    return _yaml(
        [
            f"moveit_controller_manager: {manager}/MoveItSimpleControllerManager",
            f"{manager}:",
            f"  controller_names: [{controller}]",
            f"  {controller}:",
            "    type: FollowJointTrajectory",
            f"    action_ns: {ACTION.rpartition('/')[2]}",
            "    default: true",
            f"    joints: [{', '.join(robot.joints)}]",
        ]
    )


def _ros2_controllers(robot: RobotDescription) -> str:
    controller, broadcaster = CONTROLLER.strip("/"), "joint_state_broadcaster"
    return _yaml(
        [
            "controller_manager:",
            "  ros__parameters:",
            f"    update_rate: {UPDATE_HZ}",
            f"    {broadcaster}: {{type: {broadcaster}/JointStateBroadcaster}}",
            f"    {controller}: {{type: {controller}/JointTrajectoryController}}",
            f"{controller}:",
            "  ros__parameters:",
            f"    joints: [{', '.join(robot.joints)}]",
            "    command_interfaces: [position]",
            "    state_interfaces: [position, velocity]",
        ]
    )


def _with_ros2_control(robot: RobotDescription) -> str:
    """The URDF with an element for ros2_control, whose joints come and go by topics.

    The robot is under the namespace `robot` there, since joint_state_broadcaster has /joint_states.
    """
    joints = "".join(
        f"    <joint name={quoteattr(name)}>\n"
        '      <command_interface name="position"/>\n'
        '      <state_interface name="position"/>\n'
        '      <state_interface name="velocity"/>\n'
        "    </joint>\n"
        for name in robot.joints
    )
    element = f"""\
  <ros2_control name="iiwa_sim" type="system">
    <hardware>
      <plugin>joint_state_topic_hardware_interface/JointStateTopicSystem</plugin>
      <param name="joint_commands_topic">/robot{COMMANDS}</param>
      <param name="joint_states_topic">/robot{STATES}</param>
    </hardware>
{joints}  </ros2_control>
"""
    body, end, rest = robot.urdf.rpartition("</robot>")
    return f"{body}{element}{end}{rest}"


def _yaml(lines: Sequence[str]) -> str:
    return "".join(f"{line}\n" for line in lines)
