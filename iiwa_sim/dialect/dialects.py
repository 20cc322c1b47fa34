"""The table of dialects, and which of them fit a robot."""

from collections.abc import Callable
from typing import NamedTuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialect.iiwa.session import IiwaSession
from iiwa_sim.dialect.krc4.session import Krc4Session
from iiwa_sim.dialect.krc4.table import REGISTERS
from iiwa_sim.dialect.ports import IIWA, KRC4
from iiwa_sim.dialect.session import Session
from iiwa_sim.dialect.wire.canned import CannedReplies
from iiwa_sim.dialect.wire.dialogue import Dialogue
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.robot.description import RobotDescription, RobotFault


class Dialect(NamedTuple):
    name: str
    """One of `iiwa_sim.dialect.ports`."""
    axes: range
    """Numbers of axes for which the dialect has messages."""
    says_bye: bool
    """Whether a client can say good-bye in it."""
    open_session: Callable[[Controller, DialectLog, str, Dialogue, bool, CannedReplies], Session]
    """Opens a session, given controller, log, name of the connection, whether it is strict, and its canned
    replies (see `IiwaSession`)."""


def _krc4(
    controller: Controller,
    log: DialectLog,
    name: str,
    dialogue: Dialogue,
    _strict: bool,  # its fields are named: no superfluous values
    _canned: CannedReplies,
) -> Krc4Session:
    return Krc4Session(controller, log, name, dialogue)


DIALECTS = {
    dialect.name: dialect
    for dialect in (
        Dialect(IIWA, range(7, 8), True, IiwaSession),
        Dialect(KRC4, range(1, REGISTERS + 1), False, _krc4),
    )
}


def fitting_dialects(description: RobotDescription) -> list[str]:
    """Names of the dialects that a robot has the axes for."""
    return [dialect.name for dialect in DIALECTS.values() if len(description.joints) in dialect.axes]


def dialect_for(name: str, description: RobotDescription) -> Dialect:
    """The dialect of that name.

    Raises `RobotFault` if the robot has the wrong number of axes for it, and ValueError for an unknown name.
    """
    if name not in DIALECTS:
        raise ValueError(f"dialect {name!r}, expected {' or '.join(DIALECTS)}")
    dialect, count = DIALECTS[name], len(description.joints)
    if count not in dialect.axes:
        others = fitting_dialects(description)
        hint = f"{', '.join(others)} (--dialect {others[0]})" if others else "none"
        few, many = dialect.axes[0], dialect.axes[-1]
        wanted = f"{few}" if few == many else f"{few} to {many}"
        raise RobotFault(
            description.settings_path,
            "joints",
            list(description.joints),
            f"{wanted} joints for dialect {name}; for {count} there is: {hint}",
        )
    return dialect
