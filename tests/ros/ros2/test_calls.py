"""What waits in the node's process for an answer."""

from __future__ import annotations

import queue
from concurrent.futures import ThreadPoolExecutor
from typing import Any, cast

from iiwa_sim.ros.ros2.rclpy_node.calls import Calls
from iiwa_sim.ros.ros2.rclpy_node.out import Out
from tests.talking import DEADLINE_S


class Lines:
    """In place of standard output."""

    def __init__(self) -> None:
        self.told: queue.Queue[dict[str, Any]] = queue.Queue()

    def tell(self, **what: Any) -> None:
        self.told.put(what)


def test_each_call_gets_its_own_answer_whatever_their_order() -> None:
    lines = Lines()
    calls = Calls(cast(Out, lines), "call")
    with ThreadPoolExecutor(2) as threads:
        waiting = {name: threads.submit(calls.ask, service=name) for name in ("stop", "get_io")}
        numbers = {}
        for _ in waiting:
            told = lines.told.get(timeout=DEADLINE_S)
            numbers[told["service"]] = told["call"]
        for name in ("get_io", "stop"):
            calls.answered(numbers[name], f"answer of {name}")
        for name, asked in waiting.items():
            assert asked.result(DEADLINE_S) == (numbers[name], f"answer of {name}")
    calls.answered(99, "of nobody")


def test_when_the_robot_ends_nothing_waits_for_it_any_more() -> None:
    lines = Lines()
    calls = Calls(cast(Out, lines), "call")
    with ThreadPoolExecutor(1) as threads:
        asked = threads.submit(calls.ask, service="stop")
        number = lines.told.get(timeout=DEADLINE_S)["call"]
        calls.close()
        assert asked.result(DEADLINE_S) == (number, None)
        assert threads.submit(calls.ask, service="stop").result(DEADLINE_S)[1] is None
