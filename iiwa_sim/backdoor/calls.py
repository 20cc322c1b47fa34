"""The handler of each command of protocol/backdoor.toml: calls the backdoor and formats the reply."""

import json
from collections.abc import Callable, Coroutine, Sequence

import msgspec

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.cell.surfaces import AnySurface, BoxSettings, CylinderSettings, PlaneSettings, SphereSettings
from iiwa_sim.dialect.wire.decimals import format_decimals
from iiwa_sim.dialect.wire.table import Request
from iiwa_sim.dialect.wire.wire_faults import (
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
from iiwa_sim.frames import Frame

DONE = "done"

Call = Callable[[Backdoor, Request], str | Coroutine[None, None, str]]
"""Gives the reply, or, where that takes time, what to await for it."""


def _does(method: Callable[[Backdoor, Request], None]) -> Call:
    """A handler for a method that returns nothing: it is answered `done`."""

    def call(backdoor: Backdoor, request: Request) -> str:
        method(backdoor, request)
        return DONE

    return call


def _adds(settings: Callable[[Request], AnySurface]) -> Call:
    return _does(lambda backdoor, request: backdoor.add_surface(settings(request)))


def _befalls(make: Callable[..., Fault]) -> Call:
    """A handler that sets a wire fault; the fault's own numbers follow those of connection and replies."""

    def call(backdoor: Backdoor, request: Request) -> None:
        connection, replies, *numbers = request.values
        backdoor.set_fault(make(*numbers), int(connection), int(replies))

    return _does(call)


def _numbers(values: Sequence[float]) -> str:
    return format_decimals(values).decode()


def _bits(values: Sequence[bool]) -> str:
    return " ".join(str(int(value)) for value in values)


def _json(value: object) -> str:
    """In ASCII, since a reply is."""
    encoded = _encode(value)
    return encoded.decode() if encoded.isascii() else json.dumps(json.loads(encoded), separators=(",", ":"))


_encode = msgspec.json.Encoder().encode


def _surface(request: Request) -> dict[str, float]:
    """The common settings of a surface, from the first six numbers and the last three."""
    x_mm, y_mm, z_mm, alpha, beta, gamma, *_, stiffness, damping, friction = request.values
    return {
        "x_mm": x_mm,
        "y_mm": y_mm,
        "z_mm": z_mm,
        "alpha": alpha,
        "beta": beta,
        "gamma": gamma,
        "stiffness_n_per_m": stiffness,
        "damping_s_per_m": damping,
        "friction": friction,
    }


def _plane(request: Request) -> PlaneSettings:
    return PlaneSettings(name=request.phrase, **_surface(request))


def _box(request: Request) -> BoxSettings:
    x_mm, y_mm, z_mm = request.values[6:9]
    return BoxSettings(name=request.phrase, size_mm=(x_mm, y_mm, z_mm), **_surface(request))


def _sphere(request: Request) -> SphereSettings:
    return SphereSettings(name=request.phrase, radius_mm=request.values[6], **_surface(request))


def _cylinder(request: Request) -> CylinderSettings:
    radius_mm, length_mm = request.values[6:8]
    return CylinderSettings(
        name=request.phrase, radius_mm=radius_mm, length_mm=length_mm, **_surface(request)
    )


def _push(backdoor: Backdoor, request: Request) -> None:
    fx, fy, fz, tx, ty, tz = request.values
    backdoor.push((fx, fy, fz, tx, ty, tz))


def _reply(backdoor: Backdoor, request: Request) -> None:
    command, reply = request.phrases
    backdoor.reply(command, reply, int(request.values[0]))


async def _advance(backdoor: Backdoor, request: Request) -> str:
    await backdoor.advance(request.values[0])
    return DONE


async def _run_until_stopped(backdoor: Backdoor, request: Request) -> str:
    return _numbers([await backdoor.run_until_stopped(request.values[0])])


CALLS: dict[str, Call] = {
    "hello": lambda _backdoor, _request: "hello",
    "pause": _does(lambda backdoor, _: backdoor.pause()),
    "resume": _does(lambda backdoor, _: backdoor.resume()),
    "set clock": _does(lambda backdoor, request: backdoor.set_clock(request.phrase.lower())),
    "get clock": lambda backdoor, _: backdoor.get_clock(),
    "advance": _advance,
    "run until stopped": _run_until_stopped,
    "push": _does(_push),
    "push joints": _does(lambda backdoor, request: backdoor.push_joints(request.values)),
    "release": _does(lambda backdoor, _: backdoor.release()),
    "add plane": _adds(_plane),
    "add box": _adds(_box),
    "add sphere": _adds(_sphere),
    "add cylinder": _adds(_cylinder),
    "move surface": _does(
        lambda backdoor, request: backdoor.move_surface(request.phrase, Frame(*request.values))
    ),
    "remove surface": _does(lambda backdoor, request: backdoor.remove_surface(request.phrase)),
    "get surfaces": lambda backdoor, _: _json(backdoor.surfaces()),
    "get cell": lambda backdoor, _: _json(backdoor.cell()),
    "set tool": _does(lambda backdoor, request: backdoor.set_tool(Frame(*request.values))),
    "get tool": lambda backdoor, _: _numbers(backdoor.tool()),
    "set input": _does(
        lambda backdoor, request: backdoor.set_input(int(request.values[0]), request.values[1] == 1.0)
    ),
    "get input": lambda backdoor, request: _bits([backdoor.input(int(request.values[0]))]),
    "get output": lambda backdoor, request: _bits([backdoor.output(int(request.values[0]))]),
    "get inputs": lambda backdoor, _: _bits(backdoor.inputs()),
    "get outputs": lambda backdoor, _: _bits(backdoor.outputs()),
    "emergency stop": _does(lambda backdoor, _: backdoor.emergency_stop()),
    "release emergency stop": _does(lambda backdoor, _: backdoor.release_emergency_stop()),
    "protective stop": _does(lambda backdoor, _: backdoor.protective_stop()),
    "drives off": _does(lambda backdoor, _: backdoor.switch_drives(on=False)),
    "drives on": _does(lambda backdoor, _: backdoor.switch_drives(on=True)),
    "reset error": _does(lambda backdoor, _: backdoor.reset_error()),
    "set override": _does(lambda backdoor, request: backdoor.set_override(request.values[0])),
    "get override": lambda backdoor, _: _numbers([backdoor.override()]),
    "place": _does(lambda backdoor, request: backdoor.place(request.values)),
    "get robot": lambda backdoor, _: _json(backdoor.robot()),
    "get state": lambda backdoor, _: _json(backdoor.state()),
    "get moves": lambda backdoor, _: _json(backdoor.moves()),
    "get dialogue": lambda backdoor, request: _json(backdoor.dialogue(int(request.values[0]))),
    "save state": _does(lambda backdoor, request: backdoor.save_state(request.phrase)),
    "restore state": _does(lambda backdoor, request: backdoor.restore_state(request.phrase)),
    "get states": lambda backdoor, _: _json(backdoor.states()),
    "seed": _does(lambda backdoor, request: backdoor.seed(int(request.values[0]))),
    "refuse next move": _does(lambda backdoor, request: backdoor.refuse_next_move(int(request.values[0]))),
    "fail move": _does(lambda backdoor, request: backdoor.fail_move(int(request.values[0]))),
    "servo timeout": _does(lambda backdoor, _: backdoor.time_out_servo()),
    "following error": _does(lambda backdoor, request: backdoor.following_error(int(request.values[0]))),
    "stick jaws": _does(lambda backdoor, request: backdoor.stick_jaws(request.values[0] == 1.0)),
    "wrong sensor": _does(
        lambda backdoor, request: backdoor.wrong_sensor(request.phrase, request.values[0] == 1.0)
    ),
    "lose part": _does(lambda backdoor, _: backdoor.lose_part()),
    "remove part": _does(lambda backdoor, request: backdoor.remove_part(request.phrase)),
    "repair gripper": _does(lambda backdoor, _: backdoor.repair_gripper()),
    "reply": _does(_reply),
    "get connections": lambda backdoor, _: _json(backdoor.connections()),
    "pass replies": _befalls(Pass),
    "delay replies": _befalls(Delay),
    "split replies": _befalls(lambda byte, pause_s: Split(int(byte), pause_s)),
    "drop replies": _befalls(Drop),
    "garble replies": _befalls(Garble),
    "close before replies": _befalls(CloseBefore),
    "close after replies": _befalls(CloseAfter),
    "reset at replies": _befalls(ResetBefore),
    "stop answering": _does(lambda backdoor, request: backdoor.stop_answering(int(request.values[0]))),
    "close connections": _does(lambda backdoor, request: backdoor.close_connections(int(request.values[0]))),
    "reset connections": _does(lambda backdoor, request: backdoor.reset_connections(int(request.values[0]))),
    "refuse connections": _does(lambda backdoor, _: backdoor.refuse_connections()),
    "accept connections": _does(lambda backdoor, _: backdoor.accept_connections()),
    "clear faults": _does(lambda backdoor, _: backdoor.clear_faults()),
}
"""All commands but `bye`, `help` and `release when gone`, which belong to the connection."""
