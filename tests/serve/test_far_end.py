"""What is known of the other end of a connection, with sockets."""

from __future__ import annotations

import socket

import pytest

from iiwa_sim.serve.far_end import FarEnds, far_end
from tests.serve.far_ends import asking, connected, far_ends_are_told


@pytest.mark.parametrize(
    ("family", "host", "both_families"),
    [
        (socket.AF_INET, "127.0.0.1", False),
        (socket.AF_INET6, "::1", False),
        (socket.AF_INET, "127.0.0.1", True),
    ],
)
def test_it_is_told_how_much_has_been_read(family: int, host: str, both_families: bool) -> None:
    if not far_ends_are_told():
        pytest.skip("this system does not tell")
    with asking() as far_ends, connected(family, host, both_families=both_families) as (ours, theirs):
        end = far_end(ours)
        assert end is not None
        read = 0
        for _ in range(50):
            ours.sendall(b"x" * 1000)
            assert far_ends.has_read(end) == read
            read += len(theirs.recv(700, socket.MSG_WAITALL))
            assert far_ends.has_read(end) == read


def test_nothing_is_known_where_the_other_end_is_not_ours_or_has_gone() -> None:
    with asking() as far_ends, connected() as (ours, theirs):
        end, of_theirs = far_end(ours), far_end(theirs)
        assert end is not None
        assert of_theirs is not None
        elsewhere = end._replace(named=end.named[:4] + b"\xc0\0\2\1".ljust(16, b"\0") + end.named[20:])
        assert far_ends.has_read(elsewhere) is None
        theirs.close()
        ours.close()
        assert far_ends.has_read(end) is None
        assert far_ends.has_read(of_theirs) is None, "where that was, somebody listens still"
        assert far_end(ours) is None


def test_nothing_is_known_before_it_is_open_and_after_it_is_closed() -> None:
    far_ends = FarEnds()
    with connected() as (ours, _):
        end = far_end(ours)
        assert end is not None
        assert far_ends.has_read(end) is None
        far_ends.open()
        far_ends.close()
        far_ends.close()
        assert far_ends.has_read(end) is None
