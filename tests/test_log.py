"""Lines of the log on a terminal and in a file."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Iterator
from contextlib import redirect_stderr

import pytest

from iiwa_sim import log

ERRATIC = "odd\n12:00:00.000 error forged\x1b[31m\r\u202e\x85\ud800"


@pytest.fixture
def root_restored() -> Iterator[None]:
    root, ours = logging.getLogger(), logging.getLogger("iiwa_sim")
    before = root.handlers[:], root.level, ours.level
    yield
    for handler in set(root.handlers) - set(before[0]):
        handler.close()
    root.handlers[:] = before[0]
    root.setLevel(before[1])
    ours.setLevel(before[2])


class Pipe:
    """A log that is set up to go into a pipe."""

    def __init__(self, level: str, as_json: bool) -> None:
        self._ours, self._theirs = os.pipe()
        with open(self._theirs, "w", closefd=False) as stderr, redirect_stderr(stderr):
            log.configure(level, as_json)

    def lines(self) -> list[str]:
        """Return all logged lines and close the log."""
        for handler in logging.getLogger().handlers:
            handler.flush()
        os.close(self._theirs)
        with os.fdopen(self._ours, "rb") as reader:
            return reader.read().decode().removesuffix("\n").split("\n")


def log_something_odd() -> None:
    log.SessionLog().refused("127.0.0.1:1", "line", -1, ERRATIC)
    try:
        raise ValueError(ERRATIC)
    except ValueError as fault:
        log.SessionLog().exception("127.0.0.1:1", "line", fault)


@pytest.mark.usefixtures("root_restored")
def test_plain_lines_cannot_be_forged_nor_steer_a_terminal() -> None:
    pipe = Pipe("debug", as_json=False)
    log_something_odd()
    refused, fault, *traceback = pipe.lines()
    assert refused.endswith(
        r" warning 127.0.0.1:1 refused 'line': odd\n12:00:00.000 error forged\x1b[31m\r\u202e\x85\ud800"
    )
    assert fault.endswith(" error 127.0.0.1:1 internal error at 'line'")
    assert traceback[0] == "    Traceback (most recent call last):"
    assert all(line.startswith("    ") and line.isprintable() for line in traceback)


@pytest.mark.usefixtures("root_restored")
def test_a_flood_of_refusals_leaves_the_log_readable() -> None:
    now_ns = 0
    pipe = Pipe("warning", as_json=True)
    ours = log.SessionLog(lambda: now_ns)
    for number in range(3_000):
        ours.refused("flooder", f"rubbish {number}", -1, "no such command")
    ours.refused("flooder", "lin move : far", 3021, "out of reach")
    ours.refused("driver", "hullo", -1, "no such command")
    now_ns = log.SECOND_NS
    ours.refused("flooder", "hallo", -1, "no such command")
    records = [json.loads(line) for line in pipe.lines()]
    lines = [each.get("line") for each in records]
    flood, others = lines[: log.REFUSALS_LOGGED], lines[log.REFUSALS_LOGGED :]
    assert flood == [f"rubbish {number}" for number in range(log.REFUSALS_LOGGED)]
    assert others == ["lin move : far", "hullo", "hallo"], "each kind and each client is logged"
    assert "further ones with code -1 in this second are not logged" in records[len(flood) - 1]["message"]
