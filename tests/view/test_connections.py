"""The page's connections to a robot: states followed, lines asked, and what comes of those who go."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from iiwa_sim.view.line_client import Lines, Refusal, Unanswered
from iiwa_sim.view.status_reader import StatusReader
from tests.talking import DEADLINE_S


@contextmanager
def following(listening: socket.socket) -> Iterator[StatusReader]:
    reader = StatusReader(listening.getsockname()[:2])
    reader.start()
    try:
        yield reader
    finally:
        reader.stop()


def line(number: int) -> bytes:
    return b'{"joint_position":[%d]}\n' % number


def newest(reader: StatusReader) -> object:
    while (state := reader.newest()) is None:
        assert reader.wait(DEADLINE_S)
    return state["joint_position"]


def test_a_robot_that_goes_is_told_and_followed_again() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening, following(listening) as reader:
        listening.settimeout(DEADLINE_S)
        reader.want(True)
        with listening.accept()[0] as robot:
            robot.sendall(line(1))
            assert newest(reader) == [1]
        again, _ = listening.accept()
        with again as robot:  # it has waited, and told why
            robot.sendall(line(2)[:9])
            robot.sendall(line(2)[9:] + line(3) + line(4)[:5])
            while newest(reader) != [3]:
                pass
            assert reader.fault == ""
            reader.want(False)
            assert robot.recv(1) == b"", "who is not wanted goes"


def test_what_is_no_status_port_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening, following(listening) as reader:
        listening.settimeout(DEADLINE_S)
        reader.want(True)
        with listening.accept()[0] as robot:
            for said in (b"220 hello\n", b"[1]\n", b"{}\n"):
                robot.sendall(said)
                assert reader.wait(DEADLINE_S)
                assert reader.newest() is None
                assert reader.fault.endswith("is no status port")


@contextmanager
def answering(*answer: Callable[[socket.socket], None]) -> Iterator[tuple[str, int]]:
    """A server whose connections, one after the other, are answered so, and then closed."""

    def serve() -> None:
        for each in answer:
            with listening.accept()[0] as connection:
                connection.settimeout(DEADLINE_S)
                each(connection)

    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(DEADLINE_S)
        thread = threading.Thread(target=serve)
        thread.start()
        yield listening.getsockname()[:2]
        thread.join(DEADLINE_S)
        assert not thread.is_alive()


def says(*replies: bytes) -> Callable[[socket.socket], None]:
    def serve(connection: socket.socket) -> None:
        with connection.makefile("rb") as lines:
            for reply in replies:
                assert lines.readline()
                connection.sendall(reply)

    return serve


def test_lines_are_asked_on_a_connection_that_comes_again() -> None:
    with answering(says(b"done\r\n", b"error 3000 no\r\n", b""), says(b"hello\r\n")) as address:
        lines = Lines(address)
        assert lines.do("place : 0") == "done"
        with pytest.raises(Refusal, match=r"^3000 no$"):
            lines.do("place : 1")
        with pytest.raises(Unanswered, match="the connection was closed"):
            lines.do("bye")
        assert lines.do("hello") == "hello"
        lines.close()


def test_the_token_is_told_first_and_one_that_does_not_fit_is_told() -> None:
    with answering(says(b"done\r\n", b"hello\r\n"), says(b"error 3040 no\r\n")) as address:
        lines = Lines(address, "swordfish")
        assert lines.do("hello") == "hello"
        lines.close()
        with pytest.raises(Unanswered, match="does not take this token"):
            lines.do("hello")


def test_a_late_reply_is_not_that_of_the_next_line() -> None:
    asked = threading.Event()

    def late(connection: socket.socket) -> None:
        with connection.makefile("rb") as lines:
            lines.readline()
            assert asked.wait(DEADLINE_S)

    with answering(late, says(b"second\r\n")) as address:
        lines = Lines(address)
        with pytest.raises(Unanswered):
            lines.ask("first", timeout_s=0.05)
        asked.set()
        assert lines.ask("second") == "second"
        lines.close()
