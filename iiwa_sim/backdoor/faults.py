"""Faults that a test bench injects into the robot and the wire. The rest of the backdoor is in
`backdoor.py`."""

from typing import get_args

import msgspec

from iiwa_sim.backdoor.base import Base, acts, called
from iiwa_sim.controller.errors import EXECUTION, ErrorRecord, Refused
from iiwa_sim.controller.handling import Handling
from iiwa_sim.protocols.faults import EVERY, LONGEST_WAIT_S, UNTIL_CLEARED, Close, Fault, Reset, Silence
from iiwa_sim.wording import harmless, shortened

ON_PURPOSE = "made to fail through the backdoor"


class Faults(Base):
    """Injected faults.

    `connection` is a number of `connections()`, `EVERY` or `NEXT`; `replies` is the number of replies
    concerned, 0 for all until `clear_faults`.
    """

    # Robot faults

    @acts
    def refuse_next_move(self, code: int) -> None:
        """Refuse the next move with this code. It is no error state."""
        self._controller.refuse_next_move(ErrorRecord(_checked(code), ON_PURPOSE))

    @acts
    def fail_move(self, code: int) -> None:
        """Make the running move fail: the robot stops on its path with this code."""
        if not self._controller.moving:
            raise Refused(EXECUTION, "nothing moves that could fail")
        self._controller.fail(_checked(code), ON_PURPOSE)

    @acts
    def time_out_servo(self) -> None:
        """End smart or direct mode as a servo timeout does, with error 3040."""
        self._controller.time_out_servo()

    @acts
    def following_error(self, joint: int) -> None:
        """Stop the robot as if a joint (from 1) had a following error, with error 3000."""
        names = self._controller.description.joints
        if not 1 <= joint <= len(names):
            raise Refused(EXECUTION, f"no joint {joint}: there are 1 to {len(names)}")
        self._controller.fail(EXECUTION, f"following error of {names[joint - 1]}: the robot stops")

    # The gripper

    @acts
    def stick_jaws(self, stuck: bool) -> None:
        """Make the jaws of the gripper stay where they are, or follow their outputs again."""
        self._handling.stick(stuck)

    @acts
    def wrong_sensor(self, sensor: str, on: bool) -> None:
        """Fix the sensor `open`, `closed` or `holds` of the gripper at a value."""
        self._handling.mistake(sensor, on)

    @acts
    def lose_part(self) -> None:
        """Let the part fall that the gripper holds."""
        self._handling.lose()

    @acts
    def remove_part(self, name: str) -> None:
        """Remove a part."""
        self._handling.remove(name)

    @acts
    def repair_gripper(self) -> None:
        """End stuck jaws and wrong sensors."""
        self._handling.repair()

    @property
    def _handling(self) -> Handling:
        handling = self._controller.handling
        if handling is None:
            raise Refused(EXECUTION, "the cell has no gripper")
        return handling

    # Replies

    @acts
    def reply(self, command: str, reply: str, times: int = 1) -> None:
        """Answer the next `times` lines of a command by `reply` without executing them; 0 for all.

        It lasts until `clear_faults`. The reply is one line of printable ASCII.
        """
        try:
            self._wire.canned.set(command, reply, times)
        except ValueError as fault:
            raise Refused(EXECUTION, str(fault)) from None

    # Wire faults

    @called
    def connections(self) -> dict[int, str]:
        """Return the connections of drivers: number and HOST:PORT."""
        return self._wire.connections()

    @acts
    def set_fault(self, fault: Fault, connection: int = EVERY, replies: int = UNTIL_CLEARED) -> None:
        """Apply a fault to the next `replies` replies of a connection, after faults set before."""
        if not isinstance(fault, Fault):
            shown = fault.__name__ if isinstance(fault, type) else repr(fault)
            kinds = ", ".join(
                f"{kind.__name__}({', '.join(kind.__struct_fields__)})" for kind in get_args(Fault)
            )
            raise Refused(EXECUTION, f"fault {harmless(shortened(shown, 40))}: expected one of {kinds}")
        if replies < 0:
            raise Refused(EXECUTION, f"{replies} replies: expected 0 or more")
        for key, value in msgspec.structs.asdict(fault).items():
            low, high = (1, float("inf")) if key == "byte" else (0.0, LONGEST_WAIT_S)
            if not low <= value <= high:
                raise Refused(EXECUTION, f"{key} {value:g}: expected {low:g} to {high:g}")
        self._wire.set(fault, connection, replies)

    @acts
    def stop_answering(self, connection: int = EVERY) -> None:
        """Neither answer nor execute lines until `clear_faults`, and then all of them."""
        self._wire.set(Silence(), connection)

    @acts
    def close_connections(self, connection: int = EVERY) -> None:
        """Close one connection, or all (FIN)."""
        self._wire.end(Close(), connection)
        if connection == EVERY:
            for each in self._ports():
                each.drop_arriving(reset=False)

    @acts
    def reset_connections(self, connection: int = EVERY) -> None:
        """Reset one connection, or all (RST)."""
        self._wire.end(Reset(), connection)
        if connection == EVERY:
            for each in self._ports():
                each.drop_arriving(reset=True)

    @acts
    def refuse_connections(self) -> None:
        """Refuse new connections of drivers; those there are served."""
        for each in self._ports():
            each.refuse()

    @acts
    def accept_connections(self) -> None:
        """Accept connections again."""
        for each in self._ports():
            each.accept()

    @acts
    def clear_faults(self) -> None:
        """End faults of the wire and of the next move, and canned replies; accept connections."""
        self._controller.refuse_next_move(None)
        self._wire.clear()
        for each in self._ports():
            each.accept()


def _checked(code: int) -> int:
    if not 1 <= code < 2**31:
        raise Refused(EXECUTION, f"code {code}: expected 1 to {2**31 - 1}")
    return code
