"""Client for KRC4 messages: ten integers I0 to I9 and ten reals R0 to R9, in XML."""

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from iiwa_sim.client.connection import Client, Floats, exactly
from iiwa_sim.client.replies import Krc4Error, Krc4Frame, ReplyError

__tracebackhide__ = True  # pytest shows the line of the test instead
LARGEST_ID = 2**31 - 1
REGISTERS = [f"{kind}{place}" for kind in "IR" for place in range(10)]
REPLY = re.compile(rb"\s*(.*?(?:</Res\s*>|<Res\b[^>]*/>))", re.DOTALL)


class Krc4(Client):
    """A robot that takes KRC4 messages; a method has the name of its message.

    Units are mm and degrees. `target` is X Y Z A B C in the base frame, as `Krc4Frame`. Errors are those of
    `Iiwa`, with `Krc4Error` as `CommandError`.
    """

    def __init__(self, host: str, port: int, timeout_s: float = 5.0, *, axes: int = 6) -> None:
        """Connect; `timeout_s` bounds that and the wait for each reply. No message has the number of axes."""
        self._axes = axes
        self._id = 0
        super().__init__(host, port, timeout_s)

    def sto(self) -> None:
        """Stop the robot on its path and discard the moves that wait."""
        self._ask("STO", 1)

    def lin(self, target: Floats) -> None:
        """Move the TCP on a straight line to a frame."""
        self._ask("LIN", 10, reals=exactly(6, target))

    def lia(self, joints_deg: Floats) -> None:
        """Move the TCP on a straight line to where it is at joint positions."""
        self._ask("LIA", 15, reals=exactly(self._axes, joints_deg))

    def ptp(self, target: Floats) -> None:
        """Move the TCP to a frame, all joints together."""
        self._ask("PTP", 20, reals=exactly(6, target))

    def pta(self, joints_deg: Floats) -> None:
        """Move all joints together to joint positions."""
        self._ask("PTA", 25, reals=exactly(self._axes, joints_deg))

    def fin(self) -> bool:
        """Return True if the robot is idle: in a pause, and while it stops, it is not."""
        return bool(self._ask("FIN", 100)[0][2])

    def sio(self, number: int, on: bool) -> None:
        """Switch a digital output."""
        self._ask("SIO", 200, [number, int(on)])

    def gio(self, number: int) -> bool:
        """Return the state of a digital output or input: outputs from 1 on, inputs behind them."""
        return bool(self._ask("GIO", 210, [number])[0][3])

    def dis(self) -> float:
        """Return how far the TCP is from the end of the running move, in mm."""
        return self._ask("DIS", 300)[1][0]

    def gop(self) -> Krc4Frame:
        """Return the frame of the TCP at the end of the running move, at rest where it is."""
        return Krc4Frame(*self._ask("GOP", 310)[1][:6])

    def goa(self) -> tuple[float, ...]:
        """Return the joint positions at the end of the running move, at rest where they are."""
        return tuple(self._ask("GOA", 320)[1][: self._axes])

    def _ask(
        self, name: str, command: int, integers: Sequence[int] = (), reals: Floats = ()
    ) -> tuple[list[int], list[float]]:
        """Send a message and return all integers and reals of its reply."""
        self._id = self._id % LARGEST_ID + 1
        # All twenty values: other servers may not take an absent one for 0.
        whole = [self._id, command, *integers, *[0] * (8 - len(integers))]
        values = zip(REGISTERS, [*whole, *reals, *[0.0] * (10 - len(reals))], strict=True)
        message = f"<Cmd>{''.join(f'<{key}>{value}</{key}>' for key, value in values)}</Cmd>"
        reply = self._exchange(name, message.encode(), REPLY)
        try:
            root = ElementTree.fromstring(reply)
            found = dict(root.attrib) | {child.tag: child.text or "" for child in root}
            answer = [int(found[key]) for key in REGISTERS[:10]]
            numbers = [float(found[key]) for key in REGISTERS[10:]]
            if answer[0] != self._id or abs(answer[1]) != command:
                raise ValueError(reply)
        except (ElementTree.ParseError, KeyError, ValueError):
            self.close()
            raise ReplyError(f"{name} was answered {reply!r}, expected I0={self._id} I1={command}") from None
        if answer[1] < 0:
            text = " ".join(map(str, (name, *integers, *reals)))
            raise Krc4Error(f"the robot rejected {text} with error {answer[2]}", answer[2])
        return answer, numbers

    def _is_stopped(self) -> bool:
        return self.fin()
