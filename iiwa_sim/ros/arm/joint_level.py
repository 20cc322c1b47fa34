"""The joint level of one robot: topics, services and the action that ROS 2 users expect of an arm, as plain
messages.

Messages are in ROS 2's form. Rates count simulated time.
"""

from collections.abc import Callable, Mapping
from typing import Any

from iiwa_sim.controller.controller import LEAST_OVERRIDE
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.trajectory_request import order_of
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.ros.arm.arm import Arm
from iiwa_sim.ros.arm.contents import STATES, Contents, Message
from iiwa_sim.ros.arm.goals import GoalEnd, feedback, goal_end, read_goal, read_trajectory
from iiwa_sim.ros.arm.interfaces import type_of
from iiwa_sim.ros.arm.links import Links
from iiwa_sim.ros.conventions import TODAYS, Conventions
from iiwa_sim.ros.rmi.message_text import converted
from iiwa_sim.ros.rmi.rates import Rates
from iiwa_sim.ros.rmi.robot import Done, Failure

Listener = Callable[[Message], None]

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
FEEDBACK, FEEDBACK_HZ = "feedback", 20

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
        arm: Arm,
        now_ns: Callable[[], int],
        tick_rate_hz: int,
        log: DialectLog,
        conventions: Conventions = TODAYS,
    ) -> None:
        """`now_ns` returns the time that goes into headers, with which stamps are compared (ns)."""
        self._arm = arm
        self.now_ns = now_ns
        self._log = log
        description = arm.description
        self._names = description.joints
        links = Links(description.urdf, self._names)
        unknown = {"/clock": arm.time_s, "/wrench": arm.wrench}
        self.published = {topic: of for topic, of in PUBLISHED.items() if unknown.get(topic, ()) is not None}
        """Type and rate of each topic of `PUBLISHED` that this robot publishes."""
        self._listeners: dict[str, list[Listener]] = {name: [] for name in PUBLISHED}
        self._contents = Contents(arm, links, now_ns)
        usual = {topic: rate_hz for topic, (_, rate_hz) in PUBLISHED.items()}
        self.rates = Rates(conventions.rates(usual), tick_rate_hz)
        """The rates of the topics that recur."""
        self._own = Rates({FEEDBACK: FEEDBACK_HZ}, tick_rate_hz)
        self._feedback: dict[int, Listener] = {}  # by the number of the trajectory
        self._goal = 0  # the number of the newest one

    @property
    def services(self) -> Mapping[str, str]:
        """Type of each service, by name. A robot behind a connection has told of its outputs by then."""
        outputs = [f"{OUTPUT}{number}" for number in range(1, self._arm.output_count + 1)]
        return {**SERVICES, **dict.fromkeys(outputs, "std_srvs/srv/SetBool")}

    @property
    def watching(self) -> bool:
        """Whether a tick may tell somebody something."""
        return bool(self._feedback) or any(self._listeners[each] for each in self.rates.rates_hz)

    def listen(self, topic: str, listener: Listener) -> None:
        """Register a listener for a topic of `PUBLISHED`; what is told once is told now."""
        self._listeners[topic].append(listener)
        content = self._contents.of(topic) if PUBLISHED[topic][1] == 0 else None
        if content is not None:
            listener(content)

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
            self._noted(self._arm.follow(request, None), who, TRAJECTORY)

    def _head_for(self, wanted: Any) -> None:
        order = order_of(wanted.name, self._names)
        if len(wanted.position) != len(order):
            raise Refused(EXECUTION, f"{len(wanted.position)} positions: expected {len(order)}")
        self._arm.head_for([wanted.position[place] for place in order], [1.0] * len(order))

    def _set_speed_scale(self, scale: float) -> None:
        if not 0.0 <= scale <= 1.0:
            raise Refused(EXECUTION, f"a speed scale of {scale:g}: expected 0 to 1")
        if 0.0 < scale < LEAST_OVERRIDE:
            raise Refused(EXECUTION, f"a speed scale of {scale:g}: expected 0, or {LEAST_OVERRIDE:g} to 1")
        self._arm.set_override(scale, _nobody)

    def send_goal(self, args: Any, ended: Callable[[GoalEnd], None], hear: Listener | None, who: str) -> int:
        """Follow a trajectory; gives the number to cancel it by. Raises BadMessage and `Refused`.

        `hear` is given feedback, at 20 Hz of simulated time.
        """
        request = read_goal(converted(args, type_of(ACTION_TYPE)), self.now_ns())
        number = 0

        def tell(end: Any) -> None:
            self._feedback.pop(number, None)
            ended(goal_end(end))

        number = self._noted(self._arm.follow(request, tell), who, ACTION)
        self._goal = number
        if hear is not None:
            self._feedback[number] = hear
        return number

    def forget(self, number: int) -> None:
        """Nobody hears the feedback of that goal any more."""
        self._feedback.pop(number, None)

    def cancel(self, number: int | None = None) -> None:
        """Cancel the goal of that number, or the one under way."""
        self._arm.cancel(self._goal if number is None else number)

    def call(self, name: str, request: Any, answer: Listener) -> None:
        """Call a service of `services`; `answer` is given the response, now or later. Raises BadMessage."""

        def done(failure: Failure | None) -> None:
            answer({"success": failure is None, "message": "" if failure is None else failure.reason})

        kind = self.services[name]
        asked = converted(request, type_of(kind))
        if kind == "std_srvs/srv/SetBool":
            self._switch(name, asked.data, done)
        elif name == "/stop":
            self._arm.stop(done)
        else:
            self._arm.reset_error(done)

    def _switch(self, name: str, on: bool, done: Done) -> None:
        if name == "/emergency_stop":
            self._arm.emergency_stop(on, done)
        else:
            self._arm.set_output(int(name.removeprefix(OUTPUT)), on, done)

    def step(self) -> None:
        """Notice that a tick has been made."""
        for topic in self.rates.due():
            self._publish(topic)
        if self._own.due():
            self._tell_feedback()

    def skip(self, ticks: int) -> None:
        """The robot has made `ticks` ticks at once, while nobody was told anything."""
        self.rates.skip(ticks)
        self._own.skip(ticks)

    def _noted(self, taken: tuple[int, str], who: str, where: str) -> int:
        number, remark = taken
        if remark:
            self._log.odd(who, where, remark)
        return number

    def _tell_feedback(self) -> None:
        progress = self._arm.progress if self._feedback else None
        hear = None if progress is None else self._feedback.get(progress.number)
        if progress is not None and hear is not None:
            hear(feedback(progress, self._names, self.now_ns()))

    def _publish(self, topic: str) -> None:
        content = self._contents.of(topic) if self._listeners[topic] else None
        if content is not None:
            for listener in list(self._listeners[topic]):
                listener(content)


def _nobody(_: Failure | None) -> None:
    """Nobody asks how it went: a topic has no answer."""
