"""The table of protocols, and which of them fit a robot."""

from collections.abc import Callable
from typing import NamedTuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.protocols.faults import CannedReplies
from iiwa_sim.protocols.iiwa import IiwaSession
from iiwa_sim.protocols.krc4 import Krc4Session
from iiwa_sim.protocols.krc4_xml import REGISTERS, load_krc4_table
from iiwa_sim.protocols.ports import IIWA, KRC4
from iiwa_sim.protocols.session import ProtocolLog, Session
from iiwa_sim.protocols.table import load_table
from iiwa_sim.robot.description import RobotDescription, RobotFault


class Protocol(NamedTuple):
    name: str
    """One of `iiwa_sim.protocols.ports`."""
    axes: range
    """Numbers of axes for which the protocol has messages."""
    says_bye: bool
    """True if a client can say good-bye in it."""
    open_session: Callable[[Controller, ProtocolLog, str, Dialogue, bool, CannedReplies], Session]
    """Opens a session, given controller, log, name of the connection, whether it is strict, and its canned
    replies (see `IiwaSession`)."""


def _krc4(
    controller: Controller,
    log: ProtocolLog,
    name: str,
    dialogue: Dialogue,
    _strict: bool,  # its fields are named: no superfluous values
    _canned: CannedReplies,
) -> Krc4Session:
    return Krc4Session(controller, log, name, dialogue)


PROTOCOLS = {
    protocol.name: protocol
    for protocol in (
        Protocol(IIWA, range(7, 8), True, IiwaSession),
        Protocol(KRC4, range(1, REGISTERS + 1), False, _krc4),
    )
}


def command_names() -> list[str]:
    """Return the names of all commands and KRC4 messages."""
    return [*load_table(IIWA).commands, *(each.tag for each in load_krc4_table().values())]


def fitting_protocols(description: RobotDescription) -> list[str]:
    """Names of the protocols that a robot has the axes for."""
    return [protocol.name for protocol in PROTOCOLS.values() if len(description.joints) in protocol.axes]


def protocol_for(name: str, description: RobotDescription) -> Protocol:
    """The protocol of that name.

    Raises `RobotFault` if the robot has the wrong number of axes for it, and ValueError for an unknown name.
    """
    if name not in PROTOCOLS:
        raise ValueError(f"protocol {name!r}, expected {' or '.join(PROTOCOLS)}")
    protocol, count = PROTOCOLS[name], len(description.joints)
    if count not in protocol.axes:
        others = fitting_protocols(description)
        hint = f"{', '.join(others)} (--protocol {others[0]})" if others else "none"
        few, many = protocol.axes[0], protocol.axes[-1]
        wanted = f"{few}" if few == many else f"{few} to {many}"
        raise RobotFault(
            description.settings_path,
            "joints",
            list(description.joints),
            f"{wanted} joints for protocol {name}; for {count} there is: {hint}",
        )
    return protocol
