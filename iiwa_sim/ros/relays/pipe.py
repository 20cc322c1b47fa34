"""The two pipes between a relay and iiwa-sim: messages of rosbridge, one in each line, as JSON."""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from importlib import import_module
from itertools import count
from typing import Any


class Fault(Exception):
    """There can be no node. The message is for the user."""


class Pipe:
    """Standard input and output, for several threads; what libraries print goes to standard error."""

    def __init__(self) -> None:
        self._out = os.fdopen(os.dup(1), "w", encoding="utf-8")
        os.dup2(2, 1)
        self._lock = threading.Lock()
        self._numbers = count(1)
        self._waiting: dict[int, Future[Any]] = {}  # by the id of the call

    def say(self, op: str, **fields: Any) -> None:
        """Send a message."""
        text = json.dumps({"op": op, **fields})
        with self._lock:
            self._out.write(text + "\n")
            self._out.flush()

    def call(self, service: str, args: Any) -> tuple[Any, str]:
        """Call a service of iiwa-sim; return its values, or the reason for which there are none."""
        number, answer = next(self._numbers), Future()  # type: tuple[int, Future[Any]]
        self._waiting[number] = answer
        self.say("call_service", service=service, args=args, id=number)
        response = answer.result()
        return (response["values"], "") if response["result"] else (None, response["values"])

    def read(self, take: Callable[[dict[str, Any]], None]) -> None:
        """Take messages until standard input ends; responses go to the waiting callers."""
        for line in sys.stdin:
            message = json.loads(line)
            if message["op"] == "service_response":
                self._waiting.pop(message["id"]).set_result(message)
            else:
                take(message)


def shortest(value: float) -> float:
    """Return the decimal that a float32 stands for: 0.1, not 0.10000000149, which may be above a limit."""
    return float(f"{value:.7g}")


def run(name: str) -> None:
    """Be a relay until standard input ends."""
    pipe = Pipe()
    config = json.loads(sys.stdin.readline() or "null")  # none if iiwa-sim has ended already
    try:
        if config:
            import_module(f"relays.{name}").serve(pipe, config)
    except ImportError as fault:
        pipe.say("fault", msg=config["lacks"].format(python=sys.executable, fault=fault))
    except Fault as fault:
        pipe.say("fault", msg=" ".join(str(fault).split())[:300])
    finally:
        os._exit(0)  # a thread of ROS that has not ended would keep the process
