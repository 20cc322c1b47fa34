"""The ROS side of a robot: its topics and services, and the transports by which others reach them."""

import time
from importlib.resources import files
from pathlib import Path

from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.log import SessionLog
from iiwa_sim.options.model import Settings
from iiwa_sim.ros.appendix_a import AppendixA
from iiwa_sim.ros.graph import NODE, Graph, types_of
from iiwa_sim.ros.images import IMAGE, Images
from iiwa_sim.ros.joint_interface import JointInterface
from iiwa_sim.ros.messages import Message
from iiwa_sim.ros.outbox import Outbox, Turns
from iiwa_sim.ros.relay import Relay
from iiwa_sim.ros.ros2_env import found_python
from iiwa_sim.ros.rosbridge_session import RosbridgeSession
from iiwa_sim.server.web_access import WebAccess
from iiwa_sim.wording import need_library

SYSTEM_PYTHON = Path("/usr/bin/python3")  # packages and distributions of ROS 1 are for it
RESULT_CONSTANTS = {2016: 0, 2021: 10, 2023: 13, 2024: 14}
"""Constants of the message Result, which count in its MD5 sum, by the year of robot_movement_interface."""
ROS1_LACKS = "--ros needs rospy ({fault}): apt install python3-rospy python3-sensor-msgs python3-std-srvs"
ROS2_LACKS = "{python} has no rclpy that works ({fault}): iiwa-sim ros2-env makes an environment that has it"


class RosSide:
    """A robot on ROS, as its settings say. Raises Unusable if a library is missing."""

    def __init__(self, controller: Controller, log: SessionLog, settings: Settings, clock: Clock) -> None:
        now_ns = None if settings.ros_stamps == "simulated" else time.time_ns
        self._graph = graph = Graph(controller, now_ns)
        self._appendix_a = AppendixA(
            graph, controller, log, apply_reference=settings.ros_reference == "apply"
        )
        self._joints = JointInterface(graph, controller, self._appendix_a.joint_states)
        self._images = Images(graph, controller, log)
        self._log = log
        turns = Turns(clock)
        self.rosbridge = self.ros1 = self.ros2 = None
        if settings.rosbridge_port is not None:
            need_library("websockets", "rosbridge")
            from iiwa_sim.ros.rosbridge_server import RosbridgeServer

            access = WebAccess(settings.rosbridge_origin, settings.rosbridge_host)
            address = settings.host, settings.rosbridge_port
            self.rosbridge = RosbridgeServer(self._open_session, address, turns, access)
        if settings.ros:
            config = self._config(settings, ros2=False) | {"lacks": ROS1_LACKS}
            self.ros1 = Relay("ROS 1", SYSTEM_PYTHON, config, self._open_session, turns)
        if settings.ros2:
            python = Path(settings.ros2_python) if settings.ros2_python else found_python()
            config = self._config(settings, ros2=True) | {"lacks": ROS2_LACKS}
            self.ros2 = Relay("ROS 2", python, config, self._open_session, turns)
        self.transports = [each for each in (self.rosbridge, self.ros1, self.ros2) if each is not None]
        """To be started and closed; `start` raises ListenFault, and RosFault if there can be no node."""

    def tick(self) -> None:
        """Notice a tick; to be called after each."""
        self._appendix_a.step()
        self._graph.step()
        self._images.step()
        self._joints.step()

    @property
    def watching(self) -> bool:
        """True if a topic has listeners, or a command is next: each tick is needed then."""
        return self.has_commands or self._graph.watching

    @property
    def has_commands(self) -> bool:
        """True if a coming tick will send a command to the robot or report the end of one."""
        return self._appendix_a.has_commands

    def _open_session(self, name: str, outbox: Outbox) -> RosbridgeSession:
        return RosbridgeSession(self._graph, self._joints, outbox, self._log, name)

    def _config(self, settings: Settings, *, ros2: bool) -> Message:
        """Return the first line for the process of a node: what there shall be, and the types."""
        graph = self._graph
        return {
            "node": NODE.lstrip("/"),
            "namespace": settings.ros_namespace.strip("/"),
            "packages": str(files("iiwa_sim.protocol").joinpath("rmi")),
            "result_constants": RESULT_CONSTANTS[settings.ros_result],
            "publish": [
                [name, kind, graph.published[name].rate_hz > 0, graph.published[name].is_latched]
                for name, kind in types_of(graph.published, ros2).items()
                if graph.published[name].kind != IMAGE
            ],
            "subscribe": list(types_of(graph.subscribed, ros2).items()),
            "serve": list(types_of(graph.services, ros2).items()),
            "actions": list(graph.actions.items()),
        }
