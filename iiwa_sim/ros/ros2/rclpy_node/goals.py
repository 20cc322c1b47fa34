"""The actions of the node: goals are asked for, followed and cancelled by lines, told to clients by rclpy."""

import threading
import time
from typing import Any

from .calls import Calls
from .messages import fill, plain
from .out import Out

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/GoalStatus."""
INVALID_GOAL = -1
BETWEEN_S = 0.001
CANCELING_S = 10.0
"""rclpy takes less to note that a goal is to be cancelled, before which it cannot be."""


class _Goal:
    """A goal that was accepted."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.handle: Any = None
        self.ended = threading.Event()
        self.status = ABORTED
        self.result: dict[str, Any] = {}
        self.cancelling = False


class Goals:
    """The goals of one action."""

    def __init__(self, ros: Any, node: Any, name: str, kind: Any, out: Out) -> None:
        """`kind` is the class of the action."""
        self._out = out
        self._name = name
        self._kind = kind
        self._responses = ros.action.GoalResponse
        self._cancelled = ros.action.CancelResponse.ACCEPT
        self.calls = Calls(out, "goal")
        self._goals: dict[int, _Goal] = {}  # accepted, and not told to have ended
        self._wished: dict[int, _Goal] = {}  # by the id of the request, which rclpy passes on as it is
        self._by_id: dict[bytes, _Goal] = {}
        self.server = ros.action.ActionServer(
            node,
            kind,
            name,
            self._execute,
            # One at a time and in their order. What follows a goal is not of this group.
            callback_group=ros.groups.MutuallyExclusiveCallbackGroup(),
            goal_callback=self._wish,
            handle_accepted_callback=self._accepted,
            cancel_callback=self._cancel,
        )

    def told(self, said: dict[str, Any]) -> None:
        """A line of iiwa-sim that concerns a goal."""
        if "accepted" in said:
            if said["accepted"]:
                self._goals[said["goal"]] = _Goal(said["goal"])  # first, since its end may follow at once
            self.calls.answered(said["goal"], said["accepted"])
        elif "feedback" in said:
            goal = self._goals.get(said["feedback"])
            if goal is not None and goal.handle is not None and not goal.ended.is_set():
                goal.handle.publish_feedback(fill(self._kind.Feedback(), said["values"]))
        else:
            self._end(said["end"], said["status"], said["result"])

    def close(self) -> None:
        """End all goals: their robot is gone."""
        self.calls.close()
        for number in list(self._goals):
            self._end(number, ABORTED, {"error_code": INVALID_GOAL, "error_string": "the robot has gone"})

    def _end(self, number: int, status: int, result: dict[str, Any]) -> None:
        goal = self._goals.get(number)
        if goal is not None:
            goal.status, goal.result = status, result
            goal.ended.set()

    def _wish(self, request: Any) -> Any:
        number, accepted = self.calls.ask(action=self._name, request=plain(request))
        if accepted:
            self._wished[id(request)] = self._goals[number]
            return self._responses.ACCEPT
        if accepted is None:
            self._out.tell(cancel=number)  # late, it would be followed for nobody
        return self._responses.REJECT

    def _accepted(self, handle: Any) -> None:
        goal = self._wished.pop(id(handle.request))
        goal.handle = handle
        self._by_id[bytes(handle.goal_id.uuid)] = goal
        handle.execute()

    def _execute(self, handle: Any) -> Any:
        """Wait for the end, and tell it. A thread waits for each goal, of which all but the newest have just
        ended."""
        goal = self._by_id[bytes(handle.goal_id.uuid)]
        goal.ended.wait()
        status, result = goal.status, goal.result
        if status == CANCELED:
            end_s = time.monotonic() + CANCELING_S
            while goal.cancelling and not handle.is_cancel_requested and time.monotonic() < end_s:
                time.sleep(BETWEEN_S)
            if not handle.is_cancel_requested:  # nobody may be told of a cancelling who has not asked for it
                status, result = ABORTED, {**result, "error_code": INVALID_GOAL}
        tell = {SUCCEEDED: handle.succeed, CANCELED: handle.canceled}.get(status, handle.abort)
        tell()
        del self._goals[goal.number], self._by_id[bytes(handle.goal_id.uuid)]
        return fill(self._kind.Result(), result)

    def _cancel(self, handle: Any) -> Any:
        goal = self._by_id.get(bytes(handle.goal_id.uuid))
        if goal is not None:
            goal.cancelling = True
            self._out.tell(cancel=goal.number)
        return self._cancelled
