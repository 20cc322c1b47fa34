"""What the page asks of the backdoor, by lines."""

from __future__ import annotations

import json
from typing import Any

from iiwa_sim.backdoor.client import BackdoorClient
from iiwa_sim.controller.errors import Refused
from iiwa_sim.server.listening import host_and_port, why
from iiwa_sim.view.line_client import ANSWER_S, Address, Refusal, Unanswered
from iiwa_sim.wording import harmless, shortened


class Bench:
    """Calls methods of the backdoor over HTTP."""

    def __init__(self, address: Address, token: str = "") -> None:
        self.address = address
        self.names: set[str] = set()
        self._token = token

    def do(self, line: str, timeout_s: float = ANSWER_S) -> str:
        """The answer to a line, as text or JSON. Raises Refusal and Unanswered."""
        command, _, rest = line.partition(" : ")
        name, arguments = _call(command, rest)
        client = BackdoorClient(*self.address, self._token, timeout_s)
        try:
            answer = getattr(client, name)(**arguments)
        except Refused as refused:
            raise Refusal(shortened(harmless(f"{refused.code} {refused.reason}"), 300)) from None
        except OSError as fault:
            raise Unanswered(f"{host_and_port(*self.address)}: {why(fault)}") from None
        return answer if isinstance(answer, str) else json.dumps(answer)

    def close(self) -> None:
        """Nothing stays open between calls."""


def _call(command: str, rest: str) -> tuple[str, dict[str, Any]]:
    if command in ("drives on", "drives off"):
        return "switch_drives", {"on": command == "drives on"}
    name = command.removeprefix("get ").replace(" ", "_") if command != "get clock" else "get_clock"
    words = rest.split()
    numbers = {"push": "wrench", "push_joints": "torques"}
    singles = {"set_override": "override", "advance": "seconds", "dialogue": "since"}
    if name in numbers:
        return name, {numbers[name]: list(map(float, words))}
    if name in singles:
        return name, {singles[name]: json.loads(rest)}
    if name == "set_input":
        return name, {"number": int(words[0]), "on": words[1] == "1"}
    return name, {"name": rest} if rest else {}
