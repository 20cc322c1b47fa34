"""Goals of the node's action, between the process and the joint level."""

from collections.abc import Callable
from typing import Any

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.ros.arm.goals import GoalEnd
from iiwa_sim.ros.arm.joint_level import ACTION, JointLevel
from iiwa_sim.ros.rmi.message_text import BadMessage

Say = Callable[..., None]


class NodeGoals:
    """The goals that one process has asked for, each by the number that the process gave it."""

    def __init__(self, arm: JointLevel, say: Say, offer: Say, log: ProtocolLog, who: str) -> None:
        """`say` writes a line to the process, `offer` one that may be left out."""
        self._arm = arm
        self._say = say
        self._offer = offer
        self._log = log
        self._who = who
        self._numbers: dict[int, int] = {}  # of the joint level

    def take(self, told: dict[str, Any]) -> None:
        """Do what a line of the process says: that a goal is asked for, or is to be cancelled."""
        if "cancel" not in told:
            self._wish(told)
        elif told["cancel"] in self._numbers:  # else it has ended meanwhile
            self._arm.cancel(self._numbers[told["cancel"]])

    def _wish(self, told: dict[str, Any]) -> None:
        """Accept or reject a goal; feedback and its end are told later."""
        goal = told["goal"]

        def ended(end: GoalEnd) -> None:
            self._numbers.pop(goal, None)
            self._say(end=goal, status=end.status, result=end.result)

        def hear(values: dict[str, Any]) -> None:
            self._offer(feedback=goal, values=values)

        try:
            if "long" in told:
                raise BadMessage(f"a goal of {told['long']} bytes as JSON: that is too long")
            number = self._arm.send_goal(told["request"], ended, hear, self._who)
        except (BadMessage, Refused) as fault:
            reason = fault.reason if isinstance(fault, Refused) else str(fault)
            self._log.refused(self._who, ACTION, COMMUNICATION_FAILURE, reason)
            self._say(goal=goal, accepted=False)
            return
        self._numbers[goal] = number
        self._say(goal=goal, accepted=True)

    def forget(self) -> None:
        """The process has ended. A goal goes on, as everywhere in ROS."""
        for number in self._numbers.values():
            self._arm.forget(number)
        self._numbers.clear()
