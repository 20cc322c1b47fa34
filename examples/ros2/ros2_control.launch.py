"""A robot that ros2_control drives over two topics, and whose joint states it tells.

A distribution of ROS 2 is sourced that has ros2_control and joint_state_topic_hardware_interface.

iiwa-sim moveit-config config
ros2 launch examples/ros2/ros2_control.launch.py config:=config
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

NAMESPACE = "robot"  # as in ros2_control.urdf


def started(context):
    config = Path(LaunchConfiguration("config").perform(context))
    description = {"robot_description": (config / "ros2_control.urdf").read_text()}
    robot = ["iiwa-sim", "--ros2", "--ros2-python", "/usr/bin/python3", "--ros-namespace", NAMESPACE]
    controllers = ["joint_state_broadcaster", "joint_trajectory_controller"]
    return [
        ExecuteProcess(cmd=robot, output="screen", on_exit=Shutdown()),
        Node(package="robot_state_publisher", executable="robot_state_publisher", parameters=[description]),
        Node(
            package="controller_manager",
            executable="ros2_control_node",
            output="screen",
            parameters=[str(config / "ros2_controllers.yaml")],
        ),
        Node(package="controller_manager", executable="spawner", arguments=controllers),
    ]


def generate_launch_description():
    config = DeclareLaunchArgument("config", description="the folder that iiwa-sim moveit-config has written")
    return LaunchDescription([config, OpaqueFunction(function=started)])
