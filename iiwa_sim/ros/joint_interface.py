"""Interface for ROS 2: joint states, transforms, a clock, and joint trajectories.

Codes and statuses of goals are those of joint_trajectory_controller; MoveIt judges by the status.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from msgspec.structs import astuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import EXECUTION, SUCCESS, Refused
from iiwa_sim.controller.joint_trajectories import (
    CANCELLED,
    GOAL_TOLERANCE,
    PATH_TOLERANCE,
    Progress,
    TrajectoryRequest,
    order_of,
)
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Transform, quaternion_from_rotation
from iiwa_sim.motion.joint_trajectory import Knot
from iiwa_sim.robot.model import arm_model
from iiwa_sim.ros.graph import Endpoint, Graph, Topic
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
ERROR_CODES = {PATH_TOLERANCE: -4, GOAL_TOLERANCE: -5}
"""Codes of control_msgs/FollowJointTrajectory_Result; -1 for other ends of an aborted goal."""


class JointInterface:
    """Topics, services and the action by which ROS 2 users see and move the joints of one robot."""

    def __init__(self, graph: Graph, controller: Controller, joint_states: Callable[[], Message]) -> None:
        """`joint_states` makes a sensor_msgs/JointState."""
        self._graph = graph
        self._controller = controller
        self._names = controller.description.joints
        links = arm_model(controller.description).links
        self._links = [(links[link.parent].name, link) for link in links if link.parent is not None]
        self._on_feedback: Callable[[Message], None] | None = None  # takes the feedback of the newest goal
        self._goal = 0  # its number
        for topic, kind, rate_hz, content in (
            (CLOCK, "rosgraph_msgs/msg/Clock", 100, lambda: {"clock": time_of(graph.simulated_ns())}),
            ("/tf", "tf2_msgs/msg/TFMessage", 100, lambda: self._transforms(moving=True)),
            ("/wrench", "geometry_msgs/msg/WrenchStamped", 100, self._wrench),
            (STATES, "sensor_msgs/msg/JointState", 100, joint_states),
            ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 1, self._diagnosis),
            ("/tf_static", "tf2_msgs/msg/TFMessage", 0, lambda: self._transforms(moving=False)),
            ("/robot_description", "std_msgs/msg/String", 0, lambda: {"data": controller.description.urdf}),
        ):
            graph.published[topic] = Topic(kind, rate_hz, content)
        graph.actions[ACTION] = ACTION_TYPE
        for topic, kind, take in (
            (TRAJECTORY, "trajectory_msgs/msg/JointTrajectory", self._follow),
            (COMMANDS, "sensor_msgs/msg/JointState", self._head_for),
            ("/set_speed_scale", "std_msgs/msg/Float64", lambda scale: controller.set_override(scale.data)),
        ):
            graph.subscribed[topic] = Endpoint(kind, take)

        def serve(name: str, kind: str, do: Callable[..., None]) -> None:
            graph.services[name] = Endpoint(f"std_srvs/srv/{kind}", partial(_answer, do))

        serve("/stop", "Trigger", controller.stop)
        serve("/reset_error", "Trigger", controller.errors.reset)
        serve("/emergency_stop", "SetBool", controller.emergency_stop)
        for number in range(1, len(controller.io.output_names) + 1):
            serve(f"/set_output_{number}", "SetBool", partial(controller.io.set_output, number))

    # The action and the topics that move the robot

    def send_goal(
        self, args: Any, ended: Callable[[int, Message], None], on_feedback: Callable[[Message], None] | None
    ) -> int:
        """Follow a FollowJointTrajectory_Goal; return the number to cancel it by. Raises BadMessage.

        `ended` is called once, with a status of action_msgs/GoalStatus and a FollowJointTrajectory_Result,
        `on_feedback` with feedback, at 20 Hz of simulated time.
        """

        def end(ending: Ending) -> None:
            self._on_feedback = None
            status, code = SUCCEEDED, 0
            if ending.reason == CANCELLED:
                status = CANCELED
            elif ending.code != SUCCESS:
                status, code = ABORTED, ERROR_CODES.get(ending.reason.partition(":")[0], -1)
            ended(status, {"error_code": code, "error_string": ending.reason})

        with self._graph.recording():
            goal = checked(args, ACTION_TYPE)
            multi, components = goal.multi_dof_trajectory, goal.component_path_tolerance
            if multi.joint_names or multi.points or components or goal.component_goal_tolerance:
                raise Refused(EXECUTION, "multi_dof_trajectory and component tolerances: expected none")
            request = _trajectory(goal.trajectory, self._graph.now_ns())._replace(
                path_tolerance={each.name: each.position for each in goal.path_tolerance},
                goal_tolerance={each.name: each.position for each in goal.goal_tolerance},
                goal_time_s=_seconds(goal.goal_time_tolerance),
            )
            self._goal = self._controller.trajectories.follow(request, end)
        self._on_feedback = on_feedback
        return self._goal

    def cancel(self, number: int | None = None) -> None:
        """Cancel the goal of that number, or the newest one."""
        self._controller.trajectories.cancel(self._goal if number is None else number)

    def step(self) -> None:
        """Notice that a tick has been made."""
        if self._on_feedback is None or not self._graph.is_due(FEEDBACK_HZ):
            return
        if (progress := self._controller.trajectories.progress) is not None:
            self._on_feedback(_feedback(progress, self._names, self._graph.header()))

    def _follow(self, trajectory: Any) -> None:
        request = _trajectory(trajectory, self._graph.now_ns())._replace(may_end_fast=True)
        self._controller.trajectories.follow(request)

    def _head_for(self, wanted: Any) -> None:
        order = order_of(wanted.name, self._names)
        if len(wanted.position) != len(order):
            raise Refused(EXECUTION, f"{len(wanted.position)} positions: expected {len(order)}")
        target = tuple(wanted.position[place] for place in order)
        self._controller.move(MoveRequest(Kind.DIRECT, target, speeds=[1.0] * len(order)))

    # States

    def _transforms(self, *, moving: bool) -> Message:
        controller, header = self._controller, self._graph.header
        links = [
            _transform(header(parent), link.name, link.pose_at(controller.joints))
            for parent, link in self._links
            if (link.joint is not None) == moving
        ]
        if moving:
            links.append(_transform(header(controller.description.flange), TOOL, controller.tool_in_flange))
        return {"transforms": links}

    def _wrench(self) -> Message:
        wrench = self._controller.cartesian_force()
        force, torque = (dict(zip("xyz", part, strict=True)) for part in (wrench[:3], wrench[3:]))
        return {"header": self._graph.header(TOOL), "wrench": {"force": force, "torque": torque}}

    def _diagnosis(self) -> Message:
        standing = self._controller.errors.standing
        level, words = (0, "ok") if standing is None else (2, f"{standing.code} {standing.reason}")
        robot = {"level": level, "name": "iiwa_sim: robot", "message": words, "hardware_id": "", "values": []}
        return {"header": self._graph.header(), "status": [robot]}


def _answer(do: Callable[..., None], request: Any) -> Message:
    try:
        do(*astuple(request))
    except Refused as refused:
        return {"success": False, "message": refused.reason}
    return {"success": True, "message": ""}


def _transform(header: Message, child: str, pose: Transform) -> Message:
    """Return a geometry_msgs/TransformStamped."""
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


def _trajectory(trajectory: Any, now_ns: int) -> TrajectoryRequest:
    """Return a trajectory_msgs/JointTrajectory as a request; a stamp of 0 means now. Raises `Refused`."""
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
    """Return a control_msgs/FollowJointTrajectory_Feedback."""
    since, desired, actual = time_of(round(1e9 * progress.time_s)), progress.desired, progress.actual
    error = ([a - b for a, b in zip(*both, strict=True)] for both in zip(desired[:2], actual, strict=True))

    def point(*found: Sequence[float]) -> Message:
        given = dict(zip(("positions", "velocities", "accelerations"), map(list, found), strict=False))
        return {"accelerations": [], **given, "effort": [], "time_from_start": since}

    points = {"desired": point(*desired), "actual": point(*actual), "error": point(*error)}
    return {"header": header, "joint_names": list(names), **points}
