"""Interface for ROS 2: joint states, transforms, a clock, and joint trajectories.

Codes and statuses of goals are those of joint_trajectory_controller; MoveIt judges by the status.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from iiwa_sim.controller.controller import LEAST_OVERRIDE, Controller
from iiwa_sim.controller.errors import EMERGENCY_STOP, EXECUTION, Refused
from iiwa_sim.controller.joint_trajectories import Outcome, Progress, TrajectoryRequest, order_of
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Transform, quaternion_from_rotation
from iiwa_sim.motion.joint_trajectory import Knot
from iiwa_sim.robot.model import arm_model
from iiwa_sim.ros.graph import Graph, Served, Topic
from iiwa_sim.ros.messages import NS_PER_S, Message, checked, time_of

_CONTROLLER = "/joint_trajectory_controller"  # as examples of ros2_control name it
ACTION = f"{_CONTROLLER}/follow_joint_trajectory"
ACTION_TYPE = "control_msgs/action/FollowJointTrajectory"
TRAJECTORY = f"{_CONTROLLER}/joint_trajectory"
STATES, COMMANDS = "/robot_joint_states", "/robot_joint_commands"
"""Topics by which joint_state_topic_hardware_interface, and so ros2_control, drives a robot."""
CLOCK = "/clock"
TOOL = "tool"
"""The frame of the TCP."""
FEEDBACK_HZ = 20
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/GoalStatus."""
_ENDS = {
    Outcome.REACHED: (SUCCEEDED, 0),
    Outcome.CANCELLED: (CANCELED, 0),
    Outcome.PATH_TOLERANCE: (ABORTED, -4),
    Outcome.GOAL_TOLERANCE: (ABORTED, -5),
    Outcome.ENDED: (ABORTED, -1),
}
"""Status, and error_code of FollowJointTrajectory's result."""


Ended = Callable[[int, Message], None]
"""Takes a status of action_msgs/GoalStatus and a control_msgs/FollowJointTrajectory_Result."""


class JointInterface:
    """Topics, services and the action by which ROS 2 users see and move the joints of one robot."""

    def __init__(self, graph: Graph, controller: Controller, joint_states: Callable[[], Message]) -> None:
        """`joint_states` makes a sensor_msgs/JointState."""
        self._graph = graph
        self._controller = controller
        self._names = controller.description.joints
        links = arm_model(controller.description).links
        self._links = [(links[link.parent].name, link) for link in links if link.parent is not None]
        self._feedback: dict[int, Callable[[Message], None]] = {}  # by the number of the trajectory
        self._goal = 0  # the number of the newest one
        for topic, kind, rate_hz, content in (
            (CLOCK, "rosgraph_msgs/msg/Clock", 100, self._clock),
            ("/tf", "tf2_msgs/msg/TFMessage", 100, self._moving_transforms),
            ("/wrench", "geometry_msgs/msg/WrenchStamped", 100, self._wrench),
            (STATES, "sensor_msgs/msg/JointState", 100, joint_states),
            ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 1, self._diagnosis),
            ("/tf_static", "tf2_msgs/msg/TFMessage", 0, self._fixed_transforms),
            ("/robot_description", "std_msgs/msg/String", 0, lambda: {"data": controller.description.urdf}),
        ):
            graph.published[topic] = Topic(kind, rate_hz, content)
        graph.actions[ACTION] = ACTION_TYPE
        graph.subscribed |= {
            TRAJECTORY: Served("trajectory_msgs/msg/JointTrajectory", self._follow),
            COMMANDS: Served("sensor_msgs/msg/JointState", self._head_for),
            "/set_speed_scale": Served("std_msgs/msg/Float64", self._set_speed_scale),
        }
        graph.services |= {
            "/stop": _trigger(controller.stop),
            "/reset_error": _trigger(controller.errors.reset),
            "/emergency_stop": _switch(self._emergency_stop),
        }
        for number in range(1, len(controller.io.output_names) + 1):
            graph.services[f"/set_output_{number}"] = _switch(partial(controller.io.set_output, number))

    # The action and the topics that move the robot

    def send_goal(self, args: Any, ended: Ended, hear: Callable[[Message], None] | None) -> int:
        """Follow a trajectory; return the number to cancel it by. Raises BadMessage and `Refused`.

        Args:
            args: A FollowJointTrajectory_Goal.
            ended: Called once, at its end.
            hear: Called with feedback, at 20 Hz of simulated time.
        """
        request = _goal(checked(args, ACTION_TYPE), self._graph.now_ns())
        number = 0

        def end(outcome: Outcome, reason: str) -> None:
            self._feedback.pop(number, None)
            status, code = _ENDS[outcome]
            ended(status, {"error_code": code, "error_string": reason})

        try:
            self._goal = number = self._controller.trajectories.follow(request, end)
        except Refused as refused:
            self._controller.errors.record(refused.code, refused.reason)
            raise
        if hear is not None:
            self._feedback[number] = hear
        return number

    def forget(self, number: int) -> None:
        """Tell nobody the feedback of that goal any more."""
        self._feedback.pop(number, None)

    def cancel(self, number: int | None = None) -> None:
        """Cancel the goal of that number, or the newest one."""
        self._controller.trajectories.cancel(self._goal if number is None else number)

    def step(self) -> None:
        """Notice that a tick has been made."""
        if self._feedback and self._graph.is_due(FEEDBACK_HZ):
            progress = self._controller.trajectories.progress
            if progress is not None and progress.number in self._feedback:
                self._feedback[progress.number](_feedback(progress, self._names, self._graph.header()))

    def _follow(self, trajectory: Any) -> None:
        request = _trajectory(trajectory, self._graph.now_ns())._replace(may_end_fast=True)
        self._controller.trajectories.follow(request)

    def _head_for(self, wanted: Any) -> None:
        order = order_of(wanted.name, self._names)
        if len(wanted.position) != len(order):
            raise Refused(EXECUTION, f"{len(wanted.position)} positions: expected {len(order)}")
        target = tuple(wanted.position[place] for place in order)
        self._controller.move(MoveRequest(Kind.DIRECT, target, speeds=[1.0] * len(order)))

    def _set_speed_scale(self, message: Any) -> None:
        scale = message.data
        if scale != 0.0 and not LEAST_OVERRIDE <= scale <= 1.0:
            raise Refused(EXECUTION, f"a speed scale of {scale:g}: expected 0, or {LEAST_OVERRIDE:g} to 1")
        self._controller.set_override(scale)

    def _emergency_stop(self, pressed: bool) -> None:
        if pressed:
            self._controller.emergency_stop()
        elif self._controller.status().error_code == EMERGENCY_STOP:
            self._controller.errors.release_emergency_stop()

    # States

    def _clock(self) -> Message:
        return {"clock": time_of(self._graph.simulated_ns())}

    def _moving_transforms(self) -> Message:
        controller, header = self._controller, self._graph.header
        told = [
            _transform(header(parent), link.name, link.pose_at(controller.joints))
            for parent, link in self._links
            if link.joint is not None
        ]
        tool = _transform(header(controller.description.flange), TOOL, controller.tool_in_flange)
        return {"transforms": [*told, tool]}

    def _fixed_transforms(self) -> Message:
        fixed = [(parent, link) for parent, link in self._links if link.joint is None]
        header = self._graph.header
        return {"transforms": [_transform(header(parent), link.name, link.pose) for parent, link in fixed]}

    def _wrench(self) -> Message:
        wrench = self._controller.cartesian_force()
        force, torque = (dict(zip("xyz", part, strict=True)) for part in (wrench[:3], wrench[3:]))
        return {"header": self._graph.header(TOOL), "wrench": {"force": force, "torque": torque}}

    def _diagnosis(self) -> Message:
        standing = self._controller.errors.standing
        level, words = (0, "ok") if standing is None else (2, f"{standing.code} {standing.reason}")
        told = {"level": level, "name": "iiwa_sim: robot", "message": words, "hardware_id": "", "values": []}
        return {"header": self._graph.header(), "status": [told]}


def _trigger(do: Callable[[], None]) -> Served:
    return Served("std_srvs/srv/Trigger", lambda _: _answer(do))


def _switch(do: Callable[[bool], None]) -> Served:
    return Served("std_srvs/srv/SetBool", lambda request: _answer(lambda: do(request.data)))


def _answer(do: Callable[[], None]) -> Message:
    try:
        do()
    except Refused as refused:
        return {"success": False, "message": refused.reason}
    return {"success": True, "message": ""}


def _transform(header: Message, child: str, pose: Transform) -> Message:
    """geometry_msgs/TransformStamped."""
    return {
        "header": header,
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", pose.translation, strict=True)),
            "rotation": dict(zip("xyzw", quaternion_from_rotation(pose.rotation), strict=True)),
        },
    }


def _seconds(time: Any) -> float:
    return float(time.sec + 1e-9 * time.nanosec)


def _goal(goal: Any, now_ns: int) -> TrajectoryRequest:
    """A FollowJointTrajectory_Goal as a request. Raises `Refused`."""
    multi = goal.multi_dof_trajectory
    if multi.joint_names or multi.points or goal.component_path_tolerance or goal.component_goal_tolerance:
        raise Refused(EXECUTION, "multi_dof_trajectory and tolerances of components: expected none")
    return _trajectory(goal.trajectory, now_ns)._replace(
        path_tolerance={each.name: each.position for each in goal.path_tolerance},
        goal_tolerance={each.name: each.position for each in goal.goal_tolerance},
        goal_time_s=_seconds(goal.goal_time_tolerance),
    )


def _trajectory(trajectory: Any, now_ns: int) -> TrajectoryRequest:
    """A trajectory_msgs/JointTrajectory as a request; a stamp of 0 means now. Raises `Refused`."""
    if any(point.effort for point in trajectory.points):
        raise Refused(EXECUTION, "effort: expected none")
    stamp = trajectory.header.stamp
    stamp_ns = stamp.sec * NS_PER_S + stamp.nanosec
    points = [
        Knot(_seconds(p.time_from_start), p.positions, p.velocities, p.accelerations)
        for p in trajectory.points
    ]
    return TrajectoryRequest(trajectory.joint_names, points, 1e-9 * (stamp_ns - now_ns) if stamp_ns else 0.0)


def _feedback(progress: Progress, names: Sequence[str], header: Message) -> Message:
    """control_msgs/FollowJointTrajectory_Feedback."""
    since = time_of(round(1e9 * progress.time_s))
    desired, actual = progress.desired, progress.actual
    error = ([a - b for a, b in zip(*both, strict=True)] for both in zip(desired[:2], actual, strict=True))

    def point(*found: Sequence[float]) -> Message:
        told = dict(zip(("positions", "velocities", "accelerations"), map(list, found), strict=False))
        return {"accelerations": [], **told, "effort": [], "time_from_start": since}

    return {
        "header": header,
        "joint_names": list(names),
        "desired": point(*desired),
        "actual": point(*actual),
        "error": point(*error),
    }
