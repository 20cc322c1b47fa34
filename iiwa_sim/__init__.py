"""iiwa-sim: a robot controller in software that speaks the text protocol of the KUKA LBR iiwa.

What a program or a test uses is offered here, each name loaded when it is first asked for:

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

if TYPE_CHECKING:
    from iiwa_sim.backdoor.client import BackdoorClient
    from iiwa_sim.cell.bodies import BoxSettings, CylinderSettings, PlaneSettings, SphereSettings
    from iiwa_sim.cell.settings import CellFault
    from iiwa_sim.client import (
        CommandError,
        Iiwa,
        Krc4,
        Krc4Error,
        ReplyError,
        UnknownCommandError,
    )
    from iiwa_sim.clock.clock import StillMoving
    from iiwa_sim.controller.errors import Refused
    from iiwa_sim.controller.state import Snapshot
    from iiwa_sim.frames import Frame
    from iiwa_sim.options.model import Settings
    from iiwa_sim.options.sources import SettingError
    from iiwa_sim.protocols.faults import (
        EVERY,
        NEXT,
        UNTIL_CLEARED,
        CloseAfter,
        CloseBefore,
        Delay,
        Drop,
        Garble,
        Pass,
        ResetBefore,
        Silence,
        Split,
    )
    from iiwa_sim.robot.description import RobotFault
    from iiwa_sim.ros.relay import RosFault
    from iiwa_sim.server.listening import ListenFault
    from iiwa_sim.simulator import Simulator
    from iiwa_sim.transcript.texts import TranscriptFault
    from iiwa_sim.wording import Unusable

__all__ = [
    "EVERY",
    "NEXT",
    "UNTIL_CLEARED",
    "BackdoorClient",
    "BoxSettings",
    "CellFault",
    "CloseAfter",
    "CloseBefore",
    "CommandError",
    "CylinderSettings",
    "Delay",
    "Drop",
    "Frame",
    "Garble",
    "Iiwa",
    "Krc4",
    "Krc4Error",
    "ListenFault",
    "Pass",
    "PlaneSettings",
    "Refused",
    "ReplyError",
    "ResetBefore",
    "RobotFault",
    "RosFault",
    "SettingError",
    "Settings",
    "Silence",
    "Simulator",
    "Snapshot",
    "SphereSettings",
    "Split",
    "StillMoving",
    "TranscriptFault",
    "UnknownCommandError",
    "Unusable",
]

_HOMES = {
    "backdoor.client": ("BackdoorClient",),
    "cell.settings": ("CellFault",),
    "cell.bodies": ("BoxSettings", "CylinderSettings", "PlaneSettings", "SphereSettings"),
    "client": ("CommandError", "Iiwa", "Krc4", "Krc4Error", "ReplyError", "UnknownCommandError"),
    "clock.clock": ("StillMoving",),
    "controller.errors": ("Refused",),
    "controller.state": ("Snapshot",),
    "protocols.faults": (
        *("EVERY", "NEXT", "UNTIL_CLEARED"),
        *("CloseAfter", "CloseBefore", "Delay", "Drop", "Garble", "Pass", "ResetBefore", "Silence", "Split"),
    ),
    "frames": ("Frame",),
    "options.model": ("Settings",),
    "options.sources": ("SettingError",),
    "robot.description": ("RobotFault",),
    "ros.relay": ("RosFault",),
    "server.listening": ("ListenFault",),
    "simulator": ("Simulator",),
    "transcript.texts": ("TranscriptFault",),
    "wording": ("Unusable",),
}
"""The modules that define what is offered, said a second time since the imports above are not carried out."""

_HOME_OF = {name: f"{__name__}.{home}" for home, names in _HOMES.items() for name in names}

if not TYPE_CHECKING:  # or every misspelt name would count as one

    def __getattr__(name: str) -> object:
        if name not in _HOME_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(_HOME_OF[name]), name)
        globals()[name] = value  # found at once from now on
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
