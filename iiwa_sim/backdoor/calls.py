"""Carries out commands of protocol/backdoor.toml by methods of the backdoor, and formats their replies.

A command is carried out by the method of its name: `set input` by `Backdoor.set_input`, `get tool` by
`Backdoor.tool`. Its phrases and numbers are the arguments, in the order of the line. Commands for which that
is not so are in `OTHERS`.
"""

import json
from collections.abc import Callable, Coroutine
from functools import partial
from inspect import iscoroutinefunction
from typing import Any

import msgspec

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.cell.surfaces import AnySurface, BoxSettings, CylinderSettings, PlaneSettings, SphereSettings
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.decimals import format_decimals
from iiwa_sim.protocols.faults import (
    CloseAfter,
    CloseBefore,
    Delay,
    Drop,
    Fault,
    Garble,
    Pass,
    ResetBefore,
    Split,
)
from iiwa_sim.protocols.table import Command, Quantity, Request

Method = Callable[..., Any]
"""Takes the backdoor and the arguments; what takes time is a coroutine."""

_encode = msgspec.json.Encoder().encode


def call(backdoor: Backdoor, request: Request) -> str | Coroutine[None, None, str]:
    """The reply to a request, or what to await for it. Raises `Refused`."""
    command = request.command
    phrases = request.phrases if command.phrase else ()
    numbers = map(_argument, command.parameters, request.values)
    method = partial(method_of(command.name), backdoor, *phrases, *numbers)
    return _later(command, method) if iscoroutinefunction(method) else _reply(command, method())


def method_of(name: str) -> Method:
    """The method for a command of the table. Raises AttributeError where there is none."""
    method: Method = OTHERS.get(name) or getattr(Backdoor, name.removeprefix("get ").replace(" ", "_"))
    return method


def _argument(quantity: Quantity, value: float) -> float | int | bool:
    if not quantity.integer:
        return value
    return value == 1.0 if (quantity.minimum, quantity.maximum) == (0, 1) else int(value)


async def _later(command: Command, method: Method) -> str:
    return _reply(command, await method())


def _reply(command: Command, result: Any) -> str:
    """A reply has ASCII only."""
    if command.reply_words:
        return command.reply_words[0]
    if command.reply_values or command.reply_list is not None:
        values = result if isinstance(result, tuple) else (result,)
        return " ".join(str(int(each)) if isinstance(each, bool) else _decimal(each) for each in values)
    if isinstance(result, str):
        return result
    encoded = _encode(result)
    return encoded.decode() if encoded.isascii() else json.dumps(json.loads(encoded), separators=(",", ":"))


def _decimal(value: float) -> str:
    return format_decimals([value]).decode()


def _adds(settings: Callable[..., AnySurface], shape: Callable[..., dict[str, Any]]) -> Method:
    """A surface: six numbers are its pose, the last three its matter, those between them its `shape`."""

    def add(backdoor: Backdoor, name: str, *numbers: float) -> None:
        pose, lengths, matter = numbers[:6], numbers[6:-3], numbers[-3:]
        keys = (*Frame._fields, "stiffness_n_per_m", "damping_s_per_m", "friction")
        common = dict(zip(keys, (*pose, *matter), strict=True))
        backdoor.add_surface(settings(name=name, **shape(*lengths), **common))

    return add


def _befalls(make: Callable[..., Fault]) -> Method:
    """A wire fault; its own numbers follow those of connection and replies."""
    return lambda backdoor, connection, replies, *numbers: backdoor.set_fault(
        make(*numbers), connection, replies
    )


OTHERS: dict[str, Method] = {
    "hello": lambda _: None,
    "get clock": Backdoor.get_clock,
    "set clock": lambda backdoor, name: backdoor.set_clock(name.lower()),
    "push": lambda backdoor, *wrench: backdoor.push(wrench),
    "push joints": lambda backdoor, *torques: backdoor.push_joints(torques),
    "place": lambda backdoor, *joints: backdoor.place(joints),
    "set tool": lambda backdoor, *pose: backdoor.set_tool(Frame(*pose)),
    "move surface": lambda backdoor, name, *pose: backdoor.move_surface(name, Frame(*pose)),
    "add plane": _adds(PlaneSettings, dict),
    "add box": _adds(BoxSettings, lambda *size_mm: {"size_mm": size_mm}),
    "add sphere": _adds(SphereSettings, lambda radius_mm: {"radius_mm": radius_mm}),
    "add cylinder": _adds(CylinderSettings, lambda r_mm, l_mm: {"radius_mm": r_mm, "length_mm": l_mm}),
    "drives off": lambda backdoor: backdoor.switch_drives(on=False),
    "drives on": lambda backdoor: backdoor.switch_drives(on=True),
    "servo timeout": Backdoor.time_out_servo,
    "pass replies": _befalls(Pass),
    "delay replies": _befalls(Delay),
    "split replies": _befalls(Split),
    "drop replies": _befalls(Drop),
    "garble replies": _befalls(Garble),
    "close before replies": _befalls(CloseBefore),
    "close after replies": _befalls(CloseAfter),
    "reset at replies": _befalls(ResetBefore),
}
