"""Faults that a test bench injects into the robot and the wire. The rest of the backdoor is in
`backdoor.py`."""

from iiwa_sim.backdoor.base import Base, acts, called
from iiwa_sim.controller.errors import EXECUTION, ErrorRecord, Refused
from iiwa_sim.controller.handling import Handling
from iiwa_sim.protocols.faults import (
    EVERY,
    FAULTS,
    LONGEST_WAIT_S,
    UNTIL_CLEARED,
    Close,
    Fault,
    Reset,
    Silence,
)
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
        """Refuse the next move that comes outside the error state, whatever it asks for."""
        self._controller.refuse_next_move(ErrorRecord(_checked(code), ON_PURPOSE))

    @acts
    def fail_move(self, code: int) -> None:
        """Make the running move fail: the robot stops on its path with an error. Refused if nothing moves."""
        if not self._controller.moving:
            raise Refused(EXECUTION, "nothing moves that could fail")
        self._controller.fail(_checked(code), ON_PURPOSE)

    @acts
    def time_out_servo(self) -> None:
        """End smart or direct mode as a servo timeout does. Refused in other modes."""
        self._controller.time_out_servo()

    @acts
    def following_error(self, joint: int) -> None:
        """Stop the robot as if a joint (numbered from 1) had a following error."""
        names = self._controller.description.joints
        if not 1 <= joint <= len(names):
            raise Refused(EXECUTION, f"no joint {joint}: there are 1 to {len(names)}")
        self._controller.fail(EXECUTION, f"following error of {names[joint - 1]}: the robot stops")

    # The gripper

    @acts
    def stick_jaws(self, stuck: bool) -> None:
        """Have the jaws of the gripper stay where they are, or follow their outputs again."""
        self._handling.stick(stuck)

    @acts
    def wrong_sensor(self, sensor: str, on: bool) -> None:
        """Have a sensor of the gripper, `open`, `closed` or `holds`, tell this, whatever is so."""
        self._handling.mistake(sensor, on)

    @acts
    def lose_part(self) -> None:
        """Have the part that the gripper holds fall. Refused where it holds none."""
        self._handling.lose()

    @acts
    def remove_part(self, name: str) -> None:
        """Take a part away. Refused where there is none of this name."""
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
        """Have the next lines of a command of the iiwa's protocol answered by `reply`, and not carried out.

        `times` is the number of lines, 0 for all until `clear_faults`. Refused for a command there is not, a
        reply that is not one line of printable ASCII, and where that protocol is not spoken.
        """
        try:
            self._wire.canned.set(command, reply, times)
        except ValueError as fault:
            raise Refused(EXECUTION, str(fault)) from None

    # Wire faults

    @called
    def connections(self) -> dict[int, str]:
        """The connections to the main port, by number."""
        return self._wire.connections()

    @acts
    def set_fault(self, fault: Fault, connection: int = EVERY, replies: int = UNTIL_CLEARED) -> None:
        """Apply a fault of `iiwa_sim.protocols.faults` to replies, after faults set before."""
        if type(fault) not in FAULTS:
            given: object = fault
            shown = given.__name__ if isinstance(given, type) else repr(given)
            kinds = ", ".join(f"{kind.__name__}({', '.join(fields)})" for kind, fields in FAULTS.items())
            raise Refused(EXECUTION, f"fault {harmless(shortened(shown, 40))}: expected one of {kinds}")
        if replies < 0:
            raise Refused(EXECUTION, f"{replies} replies: expected 0 or more")
        for key, value in getattr(fault, "_asdict", dict)().items():
            low, high = (1, float("inf")) if key == "byte" else (0.0, LONGEST_WAIT_S)
            if not low <= value <= high:
                raise Refused(EXECUTION, f"{key} {value:g}: expected {low:g} to {high:g}")
        self._wire.set(fault, connection, replies)

    @acts
    def stop_answering(self, connection: int = EVERY) -> None:
        """Neither answer lines nor carry them out until `clear_faults`."""
        self._wire.set(Silence(), connection)

    @acts
    def close_connections(self, connection: int = EVERY) -> None:
        """Close one connection, or all."""
        self._wire.end(Close(), connection)
        if connection == EVERY:
            for each in self._entrances:
                each.drop_arriving(reset=False)

    @acts
    def reset_connections(self, connection: int = EVERY) -> None:
        """Reset one connection, or all."""
        self._wire.end(Reset(), connection)
        if connection == EVERY:
            for each in self._entrances:
                each.drop_arriving(reset=True)

    @acts
    def refuse_connections(self) -> None:
        """Refuse new connections on the ports of all protocols. Present connections are served."""
        for each in self._entrances:
            each.refuse()

    @acts
    def accept_connections(self) -> None:
        """Accept new connections again."""
        for each in self._entrances:
            each.accept()

    @acts
    def clear_faults(self) -> None:
        """Remove all faults of the wire and of the next move, and canned replies; accept connections."""
        self._controller.refuse_next_move(None)
        self._wire.clear()
        for each in self._entrances:
            each.accept()


def _checked(code: int) -> int:
    if not 1 <= code < 2**31:
        raise Refused(EXECUTION, f"code {code}: expected 1 to {2**31 - 1}")
    return code
