"""A robot that ros2_control drives over two topics, and whose joint states it publishes.

A distribution of ROS 2 is sourced that has ros2_control and joint_state_topic_hardware_interface.

ros2 launch examples/ros2/ros2_control.launch.py robot:=robots/lbr_iiwa_7_r800
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

NAMESPACE = "robot"  # as in ros2_control.xml


def started(context):
    folder = Path(LaunchConfiguration("robot").perform(context))
    control = (folder / "moveit" / "ros2_control.xml").read_text()
    urdf = (folder / "robot.urdf").read_text().replace("</robot>", f"{control}</robot>")
    description = {"robot_description": urdf}
    ros = ["--ros2", "--ros2-python", "/usr/bin/python3", "--ros-namespace", NAMESPACE]
    controllers = ["joint_state_broadcaster", "joint_trajectory_controller"]
    return [
        ExecuteProcess(cmd=["iiwa-sim", "--robot", str(folder), *ros], output="screen", on_exit=Shutdown()),
        Node(package="robot_state_publisher", executable="robot_state_publisher", parameters=[description]),
        Node(
            package="controller_manager",
            executable="ros2_control_node",
            output="screen",
            parameters=[str(folder / "moveit" / "ros2_controllers.yaml")],
        ),
        Node(package="controller_manager", executable="spawner", arguments=controllers),
    ]


def generate_launch_description():
    robot = DeclareLaunchArgument("robot", description="the robot's folder, with robot.urdf and moveit/")
    return LaunchDescription([robot, OpaqueFunction(function=started)])
