"""Goals of control_msgs/FollowJointTrajectory: read, and told how they ended.

Codes and statuses are those of joint_trajectory_controller; MoveIt judges by the status.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.trajectories import Outcome, Progress, TrajectoryEnd
from iiwa_sim.controller.trajectory_request import Tolerance, TrajectoryPoint, TrajectoryRequest
from iiwa_sim.ros.arm.messages import ns_of, seconds_of, time_of

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/GoalStatus."""
SUCCESSFUL, INVALID_GOAL, PATH_TOLERANCE_VIOLATED, GOAL_TOLERANCE_VIOLATED = 0, -1, -4, -5
"""Codes of FollowJointTrajectory's result."""

_ENDS = {
    Outcome.REACHED: (SUCCEEDED, SUCCESSFUL),
    Outcome.CANCELLED: (CANCELED, SUCCESSFUL),
    Outcome.PATH_TOLERANCE: (ABORTED, PATH_TOLERANCE_VIOLATED),
    Outcome.GOAL_TOLERANCE: (ABORTED, GOAL_TOLERANCE_VIOLATED),
    Outcome.ENDED: (ABORTED, INVALID_GOAL),
}


class GoalEnd(NamedTuple):
    """The end of a goal."""

    status: int
    """A status of action_msgs/GoalStatus: 4 succeeded, 5 cancelled, 6 aborted."""
    result: dict[str, Any]
    """control_msgs/FollowJointTrajectory_Result."""


def goal_end(end: TrajectoryEnd) -> GoalEnd:
    """What the client is told."""
    status, code = _ENDS[end.outcome]
    return GoalEnd(status, {"error_code": code, "error_string": end.reason})


def read_goal(goal: Any, now_ns: int) -> TrajectoryRequest:
    """A goal (FollowJointTrajectory_Goal) as a request. Raises `Refused`."""
    if goal.multi_dof_trajectory.joint_names or goal.multi_dof_trajectory.points:
        raise Refused(EXECUTION, "multi_dof_trajectory: expected an empty one")
    if goal.component_path_tolerance or goal.component_goal_tolerance:
        raise Refused(EXECUTION, "component tolerances: expected none")
    return read_trajectory(goal.trajectory, now_ns)._replace(
        path_tolerance=_tolerances(goal.path_tolerance),
        goal_tolerance=_tolerances(goal.goal_tolerance),
        goal_time_s=seconds_of(goal.goal_time_tolerance),
    )


def read_trajectory(trajectory: Any, now_ns: int) -> TrajectoryRequest:
    """A trajectory_msgs/JointTrajectory as a request; a stamp of 0 means now. Raises `Refused`."""
    if any(point.effort for point in trajectory.points):
        raise Refused(EXECUTION, "effort: expected none")
    stamp_ns = ns_of(trajectory.header.stamp)
    points = [
        TrajectoryPoint(seconds_of(p.time_from_start), p.positions, p.velocities, p.accelerations)
        for p in trajectory.points
    ]
    delay_s = 1e-9 * (stamp_ns - now_ns) if stamp_ns else 0.0
    return TrajectoryRequest(trajectory.joint_names, points, delay_s)


def feedback(progress: Progress, names: Sequence[str], now_ns: int) -> dict[str, Any]:
    """control_msgs/FollowJointTrajectory_Feedback."""
    since = time_of(round(1e9 * progress.time_s))
    positions, velocities, accelerations = progress.desired
    there, speeds = progress.actual
    off = [wanted - is_there for wanted, is_there in zip(positions, there, strict=True)]
    slow = [wanted - speed for wanted, speed in zip(velocities, speeds, strict=True)]

    def point(q: Sequence[float], v: Sequence[float], a: Sequence[float]) -> dict[str, Any]:
        return {
            "positions": list(q),
            "velocities": list(v),
            "accelerations": list(a),
            "effort": [],
            "time_from_start": since,
        }

    return {
        "header": {"stamp": time_of(now_ns), "frame_id": ""},
        "joint_names": list(names),
        "desired": point(positions, velocities, accelerations),
        "actual": point(there, speeds, ()),
        "error": point(off, slow, ()),
    }


def _tolerances(told: Sequence[Any]) -> dict[str, Tolerance]:
    return {each.name: Tolerance(each.position, each.velocity) for each in told}
