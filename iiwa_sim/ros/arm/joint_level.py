"""The joint level of one robot: topics, services and the action that ROS 2 users expect of an arm, as plain
messages.

Messages are in ROS 2's form. Rates count simulated time.
"""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from iiwa_sim.controller.controller import LEAST_OVERRIDE, Controller
from iiwa_sim.controller.errors import EMERGENCY_STOP, EXECUTION, Refused
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.controller.trajectory_request import order_of
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.robot.model import arm_model
from iiwa_sim.ros.arm.contents import STATES, Contents, Message
from iiwa_sim.ros.arm.goals import GoalEnd, feedback, goal_end, read_goal, read_trajectory
from iiwa_sim.ros.arm.interfaces import type_of
from iiwa_sim.ros.arm.links import Links
from iiwa_sim.ros.rmi.message_text import converted
from iiwa_sim.ros.rmi.rates import Rates

Listener = Callable[[Message], None]
T = TypeVar("T")

CONTROLLER = "/joint_trajectory_controller"
"""The name of the controller that follows trajectories, as examples of ros2_control have it."""
ACTION = f"{CONTROLLER}/follow_joint_trajectory"
ACTION_TYPE = "control_msgs/action/FollowJointTrajectory"
TRAJECTORY = f"{CONTROLLER}/joint_trajectory"
COMMANDS = "/robot_joint_commands"
"""Where joint_state_topic_hardware_interface publishes, with which ros2_control drives a robot."""
SPEED_SCALE = "/set_speed_scale"
OUTPUT = "/set_output_"
"""A service for each output, by its number from 1."""
FEEDBACK_HZ = 20

PUBLISHED: Mapping[str, tuple[str, int]] = {
    "/clock": ("rosgraph_msgs/msg/Clock", 100),
    "/tf": ("tf2_msgs/msg/TFMessage", 100),
    "/wrench": ("geometry_msgs/msg/WrenchStamped", 100),
    STATES: ("sensor_msgs/msg/JointState", 100),
    "/diagnostics": ("diagnostic_msgs/msg/DiagnosticArray", 1),
    "/tf_static": ("tf2_msgs/msg/TFMessage", 0),
    "/robot_description": ("std_msgs/msg/String", 0),
}
"""Type of each topic, and its rate in Hz of simulated time; 0 for those that a listener gets once, at
once."""
SUBSCRIBED: Mapping[str, str] = {
    TRAJECTORY: "trajectory_msgs/msg/JointTrajectory",
    COMMANDS: "sensor_msgs/msg/JointState",
    SPEED_SCALE: "std_msgs/msg/Float64",
}
SERVICES: Mapping[str, str] = {
    "/stop": "std_srvs/srv/Trigger",
    "/reset_error": "std_srvs/srv/Trigger",
    "/emergency_stop": "std_srvs/srv/SetBool",
}
"""Type of each service that every robot has; each output of a robot has one of its own, too."""


class JointLevel:
    """The topics and services by which ROS 2 users see and move the joints of one robot."""

    def __init__(
        self,
        controller: Controller,
        now_ns: Callable[[], int],
        tick_rate_hz: int,
        log: ProtocolLog,
    ) -> None:
        """`now_ns` returns the time that goes into headers, with which stamps are compared (ns)."""
        self._controller = controller
        self.now_ns = now_ns
        self._log = log
        self._names = controller.description.joints
        outputs = [f"{OUTPUT}{number}" for number in range(1, len(controller.io.output_names) + 1)]
        self.services: Mapping[str, str] = {**SERVICES, **dict.fromkeys(outputs, "std_srvs/srv/SetBool")}
        """Type of each service, by name."""
        self._listeners: dict[str, list[Listener]] = {name: [] for name in PUBLISHED}
        self._contents = Contents(controller, Links(arm_model(controller.description).links), now_ns)
        self._rates = Rates({topic: rate_hz for topic, (_, rate_hz) in PUBLISHED.items()}, tick_rate_hz)
        self._feedback_rate = Rates({ACTION: FEEDBACK_HZ}, tick_rate_hz)
        self._feedback: dict[int, Listener] = {}  # by the number of the trajectory
        self._goal = 0  # the number of the newest one

    @property
    def watching(self) -> bool:
        """Whether a tick may tell somebody something."""
        return bool(self._feedback) or any(self._listeners[each] for each in self._rates.names)

    def listen(self, topic: str, listener: Listener) -> None:
        """Register a listener for a topic of `PUBLISHED`; what is told once is told now."""
        self._listeners[topic].append(listener)
        if PUBLISHED[topic][1] == 0:
            listener(self._contents.of(topic))

    def unlisten(self, topic: str, listener: Listener) -> None:
        """Remove a listener."""
        self._listeners[topic].remove(listener)

    def receive(self, topic: str, content: Any, who: str) -> None:
        """Take a message for a topic of `SUBSCRIBED`. Raises BadMessage and `Refused`; nothing changes then.

        `who` has sent it, for the log.
        """
        told = converted(content, type_of(SUBSCRIBED[topic]))
        if topic == COMMANDS:
            self._head_for(told)
        elif topic == SPEED_SCALE:
            self._set_speed_scale(told.data)
        else:
            request = read_trajectory(told, self.now_ns())._replace(may_end_fast=True)
            self._noted(self._recorded(lambda: self._controller.follow(request, None)), who, TRAJECTORY)

    def _head_for(self, wanted: Any) -> None:
        order = order_of(wanted.name, self._names)
        if len(wanted.position) != len(order):
            raise Refused(EXECUTION, f"{len(wanted.position)} positions: expected {len(order)}")
        target = tuple(wanted.position[place] for place in order)
        move = MoveRequest(Kind.DIRECT, target, speeds=[1.0] * len(order))
        self._recorded(lambda: self._controller.move(move))

    def _set_speed_scale(self, scale: float) -> None:
        if not 0.0 <= scale <= 1.0:
            raise Refused(EXECUTION, f"a speed scale of {scale:g}: expected 0 to 1")
        if 0.0 < scale < LEAST_OVERRIDE:
            raise Refused(EXECUTION, f"a speed scale of {scale:g}: expected 0, or {LEAST_OVERRIDE:g} to 1")
        self._controller.set_override(scale)

    def send_goal(self, args: Any, ended: Callable[[GoalEnd], None], hear: Listener | None, who: str) -> int:
        """Follow a trajectory; gives the number to cancel it by. Raises BadMessage and `Refused`.

        `hear` is given feedback, at 20 Hz of simulated time.
        """
        request = read_goal(converted(args, type_of(ACTION_TYPE)), self.now_ns())
        number = 0

        def tell(end: Any) -> None:
            self._feedback.pop(number, None)
            ended(goal_end(end))

        followed = self._recorded(lambda: self._controller.follow(request, tell))
        number = self._noted(followed, who, ACTION)
        self._goal = number
        if hear is not None:
            self._feedback[number] = hear
        return number

    def forget(self, number: int) -> None:
        """Nobody hears the feedback of that goal any more."""
        self._feedback.pop(number, None)

    def cancel(self, number: int | None = None) -> None:
        """Cancel the goal of that number, or the one under way."""
        self._controller.cancel_trajectory(self._goal if number is None else number)

    def call(self, name: str, request: Any) -> Message:
        """Call a service of `services`; gives the response. Raises BadMessage."""
        kind = self.services[name]
        asked = converted(request, type_of(kind))
        try:
            if kind == "std_srvs/srv/SetBool":
                self._switch(name, asked.data)
            elif name == "/stop":
                self._controller.stop()
            else:
                self._controller.reset_error()
        except Refused as refused:
            return {"success": False, "message": refused.reason}
        return {"success": True, "message": ""}

    def _switch(self, name: str, on: bool) -> None:
        controller = self._controller
        if name != "/emergency_stop":
            controller.io.set_output(int(name.removeprefix(OUTPUT)), on)
        elif on:
            controller.emergency_stop()
        elif controller.status().error_code == EMERGENCY_STOP:
            controller.release_emergency_stop()

    def step(self) -> None:
        """Notice that a tick has been made."""
        for topic in self._rates.due():
            self._publish(topic)
        if self._feedback_rate.due():
            self._tell_feedback()

    def skip(self, ticks: int) -> None:
        """The robot has made `ticks` ticks at once, while nobody was told anything."""
        self._rates.skip(ticks)
        self._feedback_rate.skip(ticks)

    def _recorded(self, do: Callable[[], T]) -> T:
        """Do it; a refusal is the robot's last error, too."""
        try:
            return do()
        except Refused as refused:
            self._controller.record_error(refused.code, refused.reason)
            raise

    def _noted(self, taken: tuple[int, str], who: str, where: str) -> int:
        number, remark = taken
        if remark:
            self._log.odd(who, where, remark)
        return number

    def _tell_feedback(self) -> None:
        progress = self._controller.trajectory if self._feedback else None
        hear = None if progress is None else self._feedback.get(progress.number)
        if progress is not None and hear is not None:
            hear(feedback(progress, self._names, self.now_ns()))

    def _publish(self, topic: str) -> None:
        if self._listeners[topic]:
            content = self._contents.of(topic)
            for listener in list(self._listeners[topic]):
                listener(content)
