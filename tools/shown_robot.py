"""A robot in a process of its own, with its ports and its live page, for who looks at that from outside."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

from iiwa_sim.client import Iiwa
from iiwa_sim.view.line_client import Lines


class Robot(NamedTuple):
    """One that has been started, with its page."""

    url: str
    driver: Iiwa
    bench: Lines

    def state(self) -> dict[str, Any]:
        """The robot's state as the status port tells it."""
        state: dict[str, Any] = json.loads(self.bench.do("get state"))
        return state


@contextlib.contextmanager
def started() -> Iterator[Robot]:
    """A robot with its ports and its page, until the context is left."""
    ports = ("--port", "--status-port", "--backdoor-port", "--view-port")
    command = [sys.executable, "-m", "iiwa_sim", *(word for port in ports for word in (port, "0"))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            told = dict(process.stdout.readline().split(" on ") for _ in ports)
            where = {kind: address.strip() for kind, address in told.items()}
            bench = Lines(_address(where["backdoor"]))
            with contextlib.closing(bench), Iiwa(*_address(where["listening"])) as driver:
                yield Robot(where["page"], driver, bench)
        finally:
            process.terminate()


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    return host, int(port)
