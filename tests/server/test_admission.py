"""Who is served when, without sockets."""

from __future__ import annotations

import asyncio

import pytest

from iiwa_sim.server.admission import LONGEST_PAUSE_S, Admission
from tests.talking import until

PAUSE_S = 0.02


class Someone:
    """A client that remembers when its turn came."""

    def __init__(self, name: str, served: list[str]) -> None:
        self.name = name
        self._served = served

    def serve(self) -> None:
        self._served.append(self.name)


class Door:
    """Clients a, b, c, ... that come and go."""

    def __init__(self, exclusive: bool = False, pause_s: float = 0.0) -> None:
        self.admission = Admission(exclusive, pause_s)
        self.served: list[str] = []
        self._clients: dict[str, Someone] = {}

    def come(self, names: str) -> str:
        """Connect clients; returns the names of those that are admitted at once."""
        at_once = ""
        for name in names:
            self._clients[name] = Someone(name, self.served)
            if self.admission.arrives(self._clients[name]):
                at_once += name
        return at_once

    def go(self, names: str) -> None:
        for name in names:
            self.admission.leaves(self._clients[name])


def test_all_are_served_at_once() -> None:
    door = Door()
    assert door.come("abc") == "abc"
    door.go("abc")
    assert door.come("d") == "d"
    assert door.served == []


def test_one_after_the_other_in_their_order() -> None:
    door = Door(exclusive=True)
    assert door.come("abcd") == "a"
    door.go("c")
    assert door.served == []
    door.go("a")
    assert door.served == ["b"]
    assert door.come("e") == ""
    door.go("b")
    door.go("d")
    door.go("e")
    assert door.served == ["b", "d", "e"]
    assert door.come("f") == "f"


@pytest.mark.parametrize("exclusive", [False, True])
async def test_a_pause_after_the_last_has_gone(exclusive: bool) -> None:
    loop = asyncio.get_running_loop()
    door = Door(exclusive, PAUSE_S)
    assert door.come("a") == "a"
    served_before: list[int] = []
    loop.call_later(PAUSE_S, lambda: served_before.append(len(door.served)))
    door.go("a")
    assert door.come("bc") == ""
    await until(lambda: bool(door.served))
    assert served_before == [0], "nobody was served before the pause was over"
    assert door.served == (["b"] if exclusive else ["b", "c"])


def test_no_pause_while_anybody_is_served() -> None:
    door = Door(pause_s=LONGEST_PAUSE_S)
    assert door.come("ab") == "ab"
    door.go("a")
    assert door.come("c") == "c"


async def test_nobodys_turn_comes_after_the_close() -> None:
    door = Door(exclusive=True, pause_s=0.001)
    door.come("ab")
    door.admission.close()
    door.go("a")
    door.go("b")
    other = Door(pause_s=0.002)  # as a measure of time
    other.come("x")
    other.go("x")
    other.come("y")
    await until(lambda: bool(other.served))
    assert door.served == []


@pytest.mark.parametrize("pause_s", [-1e-9, float("nan"), LONGEST_PAUSE_S + 1])
def test_a_pause_out_of_range_is_refused(pause_s: float) -> None:
    with pytest.raises(ValueError, match="expected 0 to 86400 s"):
        Admission(pause_s=pause_s)
