"""iiwa-sim: a robot controller in software that speaks the text protocol of the KUKA LBR iiwa.

This package offers the names for programs and tests, each loaded when it is first asked for:

    from iiwa_sim import Simulator          # a robot that listens, in a thread or in an asyncio loop
    from iiwa_sim import Iiwa, Krc4         # clients of one, for the text protocol and for KRC4 messages
    from iiwa_sim import Drop, Delay        # wire faults, for `simulator.backdoor.set_fault`
    from iiwa_sim import BackdoorClient     # its backdoor, from another process or machine
    from iiwa_sim import BoxSettings        # surfaces, for `simulator.backdoor.add_surface`

The clients load nothing of the simulator. PYTEST_DONT_REWRITE keeps pytest, which loads our plugin, from a
warning where this was imported before.
"""

from importlib import import_module
from typing import TYPE_CHECKING

# ruff: noqa: I001 - several lines for a module with many names
if TYPE_CHECKING:
    from iiwa_sim.backdoor.client import BackdoorClient as BackdoorClient
    from iiwa_sim.cell.bodies import BoxSettings as BoxSettings, CylinderSettings as CylinderSettings
    from iiwa_sim.cell.bodies import PlaneSettings as PlaneSettings, SphereSettings as SphereSettings
    from iiwa_sim.cell.settings import CellFault as CellFault
    from iiwa_sim.client import CommandError as CommandError, Iiwa as Iiwa, Krc4 as Krc4
    from iiwa_sim.client import Krc4Error as Krc4Error, ReplyError as ReplyError
    from iiwa_sim.client import UnknownCommandError as UnknownCommandError
    from iiwa_sim.clock.clock import StillMoving as StillMoving
    from iiwa_sim.controller.errors import Refused as Refused
    from iiwa_sim.controller.state import Snapshot as Snapshot
    from iiwa_sim.frames import Frame as Frame
    from iiwa_sim.options.model import SettingError as SettingError, Settings as Settings
    from iiwa_sim.protocols.faults import EVERY as EVERY, NEXT as NEXT, UNTIL_CLEARED as UNTIL_CLEARED
    from iiwa_sim.protocols.faults import CloseAfter as CloseAfter, CloseBefore as CloseBefore, Delay as Delay
    from iiwa_sim.protocols.faults import Drop as Drop, Garble as Garble, Pass as Pass, Silence as Silence
    from iiwa_sim.protocols.faults import ResetBefore as ResetBefore, Split as Split
    from iiwa_sim.simulator import Simulator as Simulator
    from iiwa_sim.wording import Unusable as Unusable

_HOMES = {
    "backdoor.client": "BackdoorClient",
    "cell.bodies": "BoxSettings CylinderSettings PlaneSettings SphereSettings",
    "cell.settings": "CellFault",
    "client": "CommandError Iiwa Krc4 Krc4Error ReplyError UnknownCommandError",
    "clock.clock": "StillMoving",
    "controller.errors": "Refused",
    "controller.state": "Snapshot",
    "frames": "Frame",
    "options.model": "SettingError Settings",
    "protocols.faults": "EVERY NEXT UNTIL_CLEARED CloseAfter CloseBefore Delay Drop Garble Pass ResetBefore "
    "Silence Split",
    "simulator": "Simulator",
    "wording": "Unusable",
}
_HOME_OF = {name: f"{__name__}.{home}" for home, names in _HOMES.items() for name in names.split()}
__all__ = [*_HOME_OF]  # noqa: PLE0604

if not TYPE_CHECKING:  # or every misspelt name would count as one

    def __getattr__(name: str) -> object:
        if name not in _HOME_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(_HOME_OF[name]), name)
        globals()[name] = value  # found at once from now on
        return value
