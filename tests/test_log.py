"""The log's lines: what reaches a terminal or a file, whatever was logged."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Iterator

import pytest

from iiwa_sim import log
from iiwa_sim.controller.force_guard import Contact
from iiwa_sim.frames import Frame

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
        log.configure(level, as_json, self._theirs)

    def lines(self) -> list[str]:
        """All that was logged; no more can be."""
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
    assert fault.endswith(" error 127.0.0.1:1 internal fault at 'line'")
    assert traceback[0] == "    Traceback (most recent call last):"
    assert all(line.startswith("    ") and line.isprintable() for line in traceback)


@pytest.mark.usefixtures("root_restored")
def test_json_lines_say_all_as_fields() -> None:
    pipe = Pipe("debug", as_json=True)
    log_something_odd()
    refused, fault = [json.loads(line) for line in pipe.lines()]
    assert refused.items() >= {
        "level": "warning", "session": "127.0.0.1:1", "line": "line", "code": -1, "reason": ERRATIC
    }.items()  # fmt: skip
    assert fault["level"] == "error"
    assert fault["traceback"].startswith("Traceback (most recent call last):")
    assert fault["time"].endswith("+00:00")


@pytest.mark.usefixtures("root_restored")
@pytest.mark.parametrize("level", log.LEVELS)
def test_the_level_decides_what_is_written(level: str) -> None:
    pipe = Pipe(level, as_json=True)
    ours = log.SessionLog()
    assert ours.commands == (level == "debug")
    ours.command("s", "hello", "hello")
    logging.getLogger("iiwa_sim.other").info("someone connected")
    ours.refused("s", "hullo", -1, "no such command")
    ours.exception("s", "hello", ValueError())
    written = [json.loads(line)["level"] for line in pipe.lines()]
    everything = ["debug", "info", "warning", "error"]
    assert written == everything[everything.index(level) :]


@pytest.mark.usefixtures("root_restored")
@pytest.mark.parametrize("level", log.LEVELS)
def test_of_other_loggers_only_warnings_are_written(level: str) -> None:
    pipe = Pipe(level, as_json=True)
    other = logging.getLogger("asyncio")
    other.debug("using a selector")
    other.info("something")
    other.warning("slow")
    other.error("broken")
    written = [json.loads(line)["message"] for line in pipe.lines()]
    assert written == (["broken"] if level == "error" else ["slow", "broken"])


@pytest.mark.usefixtures("root_restored")
def test_a_robot_that_stops_since_its_client_has_gone_is_told() -> None:
    pipe = Pipe("info", as_json=True)
    log.SessionLog().stopped("127.0.0.1:1", vanished=True)
    log.SessionLog().stopped("127.0.0.1:1", vanished=False)
    vanished, bye = [json.loads(line) for line in pipe.lines()]
    assert (vanished["level"], bye["level"]) == ("warning", "info")
    assert vanished["message"].startswith("127.0.0.1:1 vanished while the robot moved: it stops")
    assert bye["message"].startswith("127.0.0.1:1 said bye while the robot moved: it stops")


@pytest.mark.usefixtures("root_restored")
def test_what_stops_the_robot_is_told_with_its_code() -> None:
    pipe = Pipe("warning", as_json=True)
    log.robot_fault(3040, "100 % odd")
    (line,) = [json.loads(line) for line in pipe.lines()]
    assert line.items() >= {
        "level": "warning", "message": "100 % odd", "code": 3040, "reason": "100 % odd"
    }.items()  # fmt: skip


@pytest.mark.usefixtures("root_restored")
def test_what_ends_a_force_move_is_told_with_axis_force_and_place() -> None:
    pipe = Pipe("warning", as_json=True)
    contact = Contact(7, "z", -12.5, 0.25, 10.0, Frame(450.0, 0.0, 120.0, 0.0, 1.5, 0.0))
    log.robot_contact(contact)
    (line,) = [json.loads(line) for line in pipe.lines()]
    assert line["message"] == str(contact)
    assert "-12.500 N along z of the TCP" in line["message"]
    assert line["move"] == 7
    assert (line["axis"], line["force_n"], line["offset_n"], line["threshold_n"]) == ("z", -12.5, 0.25, 10.0)
    assert line["tcp"]["z_mm"] == 120.0


@pytest.mark.usefixtures("root_restored")
def test_a_traceback_longer_than_a_pipe_takes_at_once_is_written_whole() -> None:
    pipe = Pipe("error", as_json=True)
    log.SessionLog().exception("s", "x" * 20_000, ValueError("y" * 20_000))
    (line,) = pipe.lines()
    assert json.loads(line)["traceback"] == "ValueError: " + "y" * 20_000
