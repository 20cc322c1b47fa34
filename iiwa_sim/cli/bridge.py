"""`iiwa-sim bridge`: puts a robot behind a connection on ROS."""

import argparse
import asyncio
import sys
from collections.abc import Sequence

from iiwa_sim import log
from iiwa_sim.cli.addresses import ROSBRIDGE_PORT, add_host
from iiwa_sim.cli.consistency import check_needs
from iiwa_sim.cli.ending import Ending
from iiwa_sim.cli.names import BRIDGE
from iiwa_sim.cli.options import (
    add_log,
    add_robot,
    add_ros,
    add_ros2,
    add_ros_conventions,
    add_ros_rate,
    add_rosbridge,
    add_server,
    ros_options,
)
from iiwa_sim.cli.output import announce
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.robot.description import DEFAULT_ROBOT
from iiwa_sim.serve.listening import host_and_port


def run(given: Sequence[str]) -> int:
    parser = _parser()
    options = parser.parse_args(given)
    check_needs(parser.error, options)
    if sys.stderr is not None:
        log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    asyncio.run(_serve(options))
    return 0


async def _serve(options: argparse.Namespace) -> None:
    from iiwa_sim.robot.description import load_robot
    from iiwa_sim.ros.bridge.bridge import Bridge

    ending = Ending()
    robot = load_robot(DEFAULT_ROBOT if options.robot is None else options.robot)
    bridge = Bridge(options.server, robot, ros_options(options))
    async with bridge:
        ending.watch()
        text = ""
        if bridge.rosbridge_address is not None:
            text += f"rosbridge on {host_and_port(*bridge.rosbridge_address)}\n"
        if bridge.ros_master is not None:
            text += f"ROS node at {bridge.ros_master}\n"
        if bridge.ros2_node is not None:
            text += f"ROS 2 node {bridge.ros2_node}\n"
        await ending.wait(announce(text, sys.stdout))


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {BRIDGE}",
        description="Puts a robot on ROS: acts as the driver of a server of the iiwa's text protocol, "
        "emulated or real, and gives it the topics and services of drag&bot, by rosbridge or as a node of "
        "ROS 1 or ROS 2.",
        examples={"172.31.1.147:30000": "puts a robot on ROS, by rosbridge on port 9090"},
    )
    add_server(parser)
    add_robot(parser)
    add_host(parser)
    add_rosbridge(parser, ROSBRIDGE_PORT)
    add_ros(parser)
    add_ros2(parser)
    add_ros_conventions(parser)
    add_ros_rate(parser)
    add_log(parser)
    return parser
