"""A robot that MoveIt moves by its action, and RViz, with a distribution of ROS 2 and MoveIt sourced.

ros2 launch examples/ros2/moveit.launch.py robot:=robots/lbr_iiwa_7_r800
"""

from pathlib import Path

import yaml
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

PLANNING = {
    "planning_pipelines": ["ompl"],
    "ompl": {
        "planning_plugins": ["ompl_interface/OMPLPlanner"],
        "request_adapters": [
            "default_planning_request_adapters/ResolveConstraintFrames",
            "default_planning_request_adapters/ValidateWorkspaceBounds",
            "default_planning_request_adapters/CheckStartStateBounds",
            "default_planning_request_adapters/CheckStartStateCollision",
        ],
        "response_adapters": [
            "default_planning_response_adapters/AddTimeOptimalParameterization",
            "default_planning_response_adapters/ValidateSolution",
            "default_planning_response_adapters/DisplayMotionPath",
        ],
    },
}


def started(context):
    folder = Path(LaunchConfiguration("robot").perform(context))

    def settings(name):
        return yaml.safe_load((folder / "moveit" / name).read_text())

    robot = [
        {"robot_description": (folder / "robot.urdf").read_text()},
        {"robot_description_semantic": (folder / "moveit" / "robot.srdf").read_text()},
        {"robot_description_kinematics": settings("kinematics.yaml")},
        {"robot_description_planning": settings("joint_limits.yaml")},
    ]
    return [
        ExecuteProcess(
            cmd=["iiwa-sim", "--robot", str(folder), "--ros2", "--ros2-python", "/usr/bin/python3"],
            output="screen",
            on_exit=Shutdown(),
        ),
        Node(
            package="moveit_ros_move_group",
            executable="move_group",
            output="screen",
            parameters=[*robot, PLANNING, settings("moveit_controllers.yaml")],
        ),
        Node(package="rviz2", executable="rviz2", parameters=[*robot, PLANNING]),
    ]


def generate_launch_description():
    robot = DeclareLaunchArgument("robot", description="the robot's folder, with robot.urdf and moveit/")
    return LaunchDescription([robot, OpaqueFunction(function=started)])
