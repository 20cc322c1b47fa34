"""The protocols by name, and which of them fit a robot."""

from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.log import SessionLog
from iiwa_sim.protocols import iiwa
from iiwa_sim.protocols.faults import CannedReplies
from iiwa_sim.protocols.ports import IIWA, KRC4
from iiwa_sim.protocols.session import LineSession, Session
from iiwa_sim.protocols.table import load_table
from iiwa_sim.robot.description import RobotDescription, RobotFault

AXES = {IIWA: range(7, 8), KRC4: range(1, 11)}
"""Numbers of axes for which each protocol has messages; one of KRC4 has ten reals."""


def open_session(
    protocol: str,
    controller: Controller,
    log: SessionLog,
    name: str,
    dialogue: Dialogue | None = None,
    strict: bool = False,
    canned: CannedReplies | None = None,
) -> Session:
    """Open a session of a protocol for a connection.

    Values after the last parameter are ignored, as by the original controller, and logged once for each
    command; a strict session rejects them.
    """
    if protocol == KRC4:
        from iiwa_sim.protocols.krc4 import Krc4Session

        return Krc4Session(controller, log, name, dialogue)
    return LineSession(controller, log, name, iiwa.COMMANDS, dialogue, strict, canned)


def command_names() -> list[str]:
    """Return the names of all commands and KRC4 messages."""
    from iiwa_sim.protocols.krc4_xml import MESSAGES

    return [*load_table(IIWA).commands, *MESSAGES]


def fitting_protocols(description: RobotDescription) -> list[str]:
    """Return the names of the protocols that a robot has the axes for."""
    return [name for name, axes in AXES.items() if len(description.joints) in axes]


def check_axes(protocol: str, description: RobotDescription) -> None:
    """Raise `RobotFault` if a robot has the wrong number of axes for a protocol."""
    others, count = fitting_protocols(description), len(description.joints)
    if protocol not in others:
        hint = f"--protocol {others[0]}, or protocol = {others[0]!r} in a [[robot]]" if others else "none"
        few, many = AXES[protocol][0], AXES[protocol][-1]
        wanted = f"{few}" if few == many else f"{few} to {many}"
        raise RobotFault(
            description.settings_path,
            "joints",
            list(description.joints),
            f"{wanted} joints for protocol {protocol}; for {count} there is: {hint}",
        )
