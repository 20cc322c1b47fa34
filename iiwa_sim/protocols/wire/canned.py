"""Canned replies of the iiwa's protocol: what a test has answered in place of the robot.

The command is not carried out. Replies that are set for one command take its lines in the order in which they
were set, each as many as it is for; then the robot answers again.
"""

from collections import deque
from dataclasses import dataclass

from iiwa_sim.protocols.wire.table_file import load_table
from iiwa_sim.wording import harmless, shortened

UNTIL_CLEARED = 0
"""Given in place of a number of lines: until it is cleared."""
_PROTOCOL = "iiwa"


@dataclass
class _Reply:
    text: str
    left: int | None  # lines; None for any number


class CannedReplies:
    """Replies that a test has laid down for one robot, for all its clients together."""

    def __init__(self) -> None:
        self.heard = True
        """Whether the robot speaks the iiwa's protocol."""
        self._replies: dict[str, deque[_Reply]] = {}
        self.any = False
        """Whether one is set: asked for at each line."""

    def set(self, command: str, reply: str, times: int = 1) -> None:
        """Have the next `times` lines of a command answered by `reply`, 0 for all until `clear`.

        Raises ValueError for a command there is not, a reply that is not one line of printable ASCII, a
        number below 0, and where the iiwa's protocol is not spoken: KRC4 messages cannot be canned.
        """
        if not self.heard:
            raise ValueError(f"reply to {_quoted(command)}: expected a robot that speaks {_PROTOCOL}")
        table = load_table(_PROTOCOL)
        known = table.find(command.encode("ascii", "backslashreplace"))
        if known is None:
            meant = table.meant(command.encode("ascii", "backslashreplace"))
            hint = f"; did you mean {meant}" if meant else ""
            raise ValueError(f"command {_quoted(command)}: expected a command of the robot's port{hint}")
        if not (reply.isascii() and reply.isprintable()):
            raise ValueError(f"reply {_quoted(reply)}: expected one line of printable ASCII")
        if times < 0:
            raise ValueError(f"times={times}: expected 0 or more")
        waiting = self._replies.setdefault(known.name, deque())
        waiting.append(_Reply(reply, times or None))
        self.any = True

    def take(self, command: str) -> str | None:
        """The reply to the next line of a command, by its name in the table; None where the robot answers."""
        waiting = self._replies.get(command)
        if waiting is None:
            return None
        first = waiting[0]
        if first.left is not None:
            first.left -= 1
            if first.left == 0:
                waiting.popleft()
                if not waiting:
                    del self._replies[command]
                    self.any = bool(self._replies)
        return first.text

    def clear(self) -> None:
        """None any more."""
        self._replies.clear()
        self.any = False


def _quoted(text: str) -> str:
    return f"'{shortened(harmless(text), 60)}'"
