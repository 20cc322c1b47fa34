"""One robot in the graph, and RViz beside it, with a distribution of ROS 2 sourced.

ros2 launch examples/ros2/one_robot.launch.py namespace:=cell
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    namespace = LaunchConfiguration("namespace")
    robot = ["iiwa-sim", "--ros2", "--ros2-python", "/usr/bin/python3", "--ros-namespace", namespace]
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="namespace of all names"),
            ExecuteProcess(cmd=robot, output="screen", on_exit=Shutdown()),
            # /tf has the poses of the links, robot_description their shapes.
            Node(
                package="rviz2",
                executable="rviz2",
                remappings=[("/tf", [namespace, "/tf"]), ("/tf_static", [namespace, "/tf_static"])],
            ),
        ]
    )
