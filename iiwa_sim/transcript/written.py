"""What is said in a dialogue, as lines of a transcript."""

from collections.abc import Sequence

from iiwa_sim.protocols.dialogue import DialogueLine, Direction
from iiwa_sim.protocols.krc4_xml import NO_MESSAGE
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL, KRC4
from iiwa_sim.protocols.table import load_table
from iiwa_sim.transcript.krc4 import answers_reals

UNSPEAKABLE = ("(too long)", NO_MESSAGE)
"""What the dialogue tells of what is not known, and so cannot be said again."""


class Lines:
    """Writes what a dialogue tells, in its order.

    Clients are called client1, client2, ... in the order in which they come. Replies of numbers are written
    as numbers, all others as they are.
    """

    def __init__(self, protocols: Sequence[str], began_ns: int) -> None:
        """`protocols` are all there are; real time is told from `began_ns` of the clock of what is told."""
        self._protocols_there = tuple(protocols)
        self._began_ns = began_ns
        self._names: dict[str, str] = {}
        self._usual_protocol = protocols[0]
        self._protocols: dict[str, str] = {}  # of clients that are there
        self._clients = 0
        self._last_said = ""
        self._table = load_table("iiwa")

    def header(self, title: str) -> str:
        """What stands above the lines, with its line ends; `title` is the first line, a comment."""
        header = f"# {title}\n# [simulated real] time in s\n"
        if self._protocols_there != (DEFAULT_PROTOCOL,):
            header += f"protocol {','.join(self._protocols_there)}\n"
        return header

    def line(self, told: DialogueLine, simulated_s: float) -> str:
        """One of them, without its end."""
        real_s = (told.instant_ns - self._began_ns) * 1e-9
        return self._line(told, f"[{simulated_s:.3f} {real_s:.6f}]")

    def _line(self, told: DialogueLine, times: str) -> str:
        if told.direction is Direction.EVENT:
            return self._event(told, times)
        name = self._name(told.session)
        if told.direction is Direction.ON_WIRE:
            return f"# {times} {name}: on the wire: {told.text}"
        text = told.text.replace("{", "\\x7b")
        if told.direction is Direction.FROM_CLIENT:
            self._last_said = told.text  # its reply comes next
        hidden = "# " if self._last_said in UNSPEAKABLE else ""
        mark = ">" if told.direction is Direction.FROM_CLIENT else self._mark(told.session, told.text)
        return f"{hidden}{times} {name}{mark} {text}"

    def _event(self, told: DialogueLine, times: str) -> str:
        if told.text == "connected":
            self._protocols[told.session] = told.protocol
            manner = "" if told.protocol == self._usual_protocol else f" in {told.protocol}"
            return f"{times} {self._name(told.session)} connects{manner}"
        if told.text == "disconnected":
            name = self._name(told.session)
            del self._names[told.session]
            self._protocols.pop(told.session, None)
            return f"{times} {name} leaves"
        return f"# {times} {told.session}: {told.text}"

    def _mark(self, session: str, reply: str) -> str:
        if self._protocols.get(session, self._usual_protocol) == KRC4:
            return "<~" if answers_reals(reply) else "<"
        command = self._table.find(self._last_said.partition(":")[0].encode())
        of_numbers = command is not None and command.reply_values and not command.reply_values[0].integer
        return "<~" if of_numbers and reply != "error" else "<"

    def _name(self, session: str) -> str:
        if session not in self._names:
            self._clients += 1
            self._names[session] = f"client{self._clients}"
        return self._names[session]
