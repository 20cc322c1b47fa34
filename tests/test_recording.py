"""The text of a dialogue for a report."""

from iiwa_sim.protocols.dialogue import Dialogue
from iiwa_sim.recording import LONGEST, Recording


class Conversation:
    """A dialogue with a recording, in which a tick passes with each exchange."""

    def __init__(self) -> None:
        self._tick = 0
        self.recording = Recording(0.002, 0)
        self._dialogue = Dialogue(lambda: self._tick)
        self._dialogue.listeners.append(self.recording)

    def exchange(self, line: str, reply: str, session: str = "client") -> None:
        self._tick += 1
        self._dialogue.exchange(session, line, reply)

    def on_wire(self, text: str, session: str = "client") -> None:
        self._dialogue.on_wire(session, text)

    def event(self, text: str) -> None:
        self._dialogue.event("robot", text)

    def lines(self) -> list[str]:
        """Without times."""
        return [line[21:] for line in self.recording.text().splitlines()[1:]]


def test_times_are_simulated_and_real() -> None:
    conversation = Conversation()
    conversation.exchange("hello", "hello")
    words = conversation.recording.text().splitlines()[1].split()
    assert words[0] == "0.002"
    assert float(words[1]) > 0.0
    assert words[2:] == ["client", ">", "hello"]


def test_who_polls_is_told_once() -> None:
    conversation = Conversation()
    conversation.exchange("lin move : 1", "done")
    for _ in range(1000):
        conversation.exchange("get status", "moving")
    conversation.exchange("get status", "stopped")
    heard = conversation.lines()
    assert heard[:3] == ["client > lin move : 1", "       < done", "client > get status"]
    assert heard[3].startswith("       < moving  (1000 times, last at")
    assert "at    2.002 " in heard[3]
    assert heard[4:] == ["client > get status", "       < stopped"]


def test_what_went_over_the_wire_stands_below_what_was_answered() -> None:
    conversation = Conversation()
    for _ in range(3):
        conversation.exchange("get status", "moving")
    for _ in range(200):  # the last of which is lost, too
        conversation.exchange("get status", "moving")
        conversation.on_wire("nothing")
    conversation.on_wire("the end (RST)")
    conversation.exchange("get status", "moving")
    conversation.on_wire("no answer", "other")
    heard = conversation.lines()
    assert heard[0] == "client > get status"
    assert heard[1].startswith("       < moving  (3 times, last at")
    assert heard[2:4] == ["client > get status", "       < moving"]
    assert heard[4].startswith("       ~ nothing  (200 times, last at")
    assert heard[5:] == [
        "client ~ the end (RST)",
        "client > get status",
        "       < moving",
        "other ~ no answer",
    ]


def test_the_newest_are_kept_and_it_is_said_how_many_are_not() -> None:
    conversation = Conversation()
    for number in range(LONGEST + 50):
        conversation.event(f"event {number}")
    first, *heard = conversation.recording.text().splitlines()[1:]
    assert first == "(50 before these are left out)"
    assert [line.split()[-1] for line in heard] == [str(number) for number in range(50, LONGEST + 50)]
