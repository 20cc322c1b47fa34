"""`iiwa-sim` without a command: it runs until a signal, or a bye with --bye-shuts-down."""

import asyncio
import contextlib
import gc
import json
import logging
import os
import resource
import signal
import socket
import sys
from collections.abc import AsyncIterator, Iterable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from typing import TYPE_CHECKING

from iiwa_sim import log
from iiwa_sim.cli.parsing import from_command_line, reached_at
from iiwa_sim.frames import Frame
from iiwa_sim.options.model import Settings
from iiwa_sim.options.sources import from_environment, merged, robots_of
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.server.listening import host_and_port, open_listener
from iiwa_sim.server.token import word_of
from iiwa_sim.wording import need_library

if TYPE_CHECKING:
    from iiwa_sim.cell.cell import Cell
    from iiwa_sim.simulator import Simulator

PAGE_ENDS_S = 5.0
"""Seconds that the process of the page has to end, before it is killed."""

logger = logging.getLogger(__name__)


def run(words: Sequence[str]) -> int:
    """Run the robots, or print the version; return the exit code."""
    given = from_command_line(words)
    if "--version" in words:
        from importlib import metadata

        print(f"iiwa-sim {metadata.version('iiwa-sim')}")
        return 0
    variables, warnings = from_environment(os.environ)
    robots = robots_of(merged(variables, given))
    common = next(iter(robots.values()))
    log.configure(common.log_level, common.log_json)
    for warning in warnings:
        logger.warning("environment variable %s", warning)
    with contextlib.suppress(OSError, ValueError):  # 500 robots open more files than the default of 1,024
        most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    asyncio.run(_serve(robots))
    return 0


async def _serve(robots: dict[str, Settings]) -> None:
    over = asyncio.Event()
    common = next(iter(robots.values()))
    try:
        async with AsyncExitStack() as running:
            page = None
            if common.view_port is not None:
                page = running.enter_context(await listen(common.view_host, common.view_port))
            # Pinocchio and Ruckig load slowly, so only when the options are known to be right.
            from iiwa_sim.simulator import Simulator

            cells: dict[object, tuple[Cell, ...]] = {}  # each file is read once for equal robots
            simulators: dict[str, Simulator] = {}
            for name, settings in robots.items():
                place, on_bye = (settings.robot, settings.cell), over.set if settings.bye_shuts_down else None
                with log.named(name):
                    simulator = Simulator(cell=cells.get(place), settings=settings, on_bye=on_bye)
                    simulators[name] = await running.enter_async_context(simulator)
                cells.setdefault(place, simulator.cells)
            for number in (signal.SIGTERM, signal.SIGINT):
                asyncio.get_running_loop().add_signal_handler(number, over.set)
            lines = [line for name, each in simulators.items() for line in _announcement(name, each)]
            if page is not None:
                lines.append(f"page on {page_url(page)}")
                # It ends before the robots, or it would miss them.
                await running.enter_async_context(_page(page, common, simulators))
            print(*lines, sep="\n", flush=True)
            gc.freeze()  # long-lived objects are not scanned for garbage while the robot moves
            gc.enable()
            await over.wait()
    finally:
        gc.unfreeze()  # otherwise Ruckig's bindings complain at exit of objects left over


def _announcement(name: str, simulator: "Simulator") -> Iterable[str]:
    """Return the listening addresses, one line for each port."""
    own, ros = simulator.host, simulator.ros
    ports: list[tuple[str, str, int | None]] = [
        (f"{robot.name} {'listening' if protocol == IIWA else protocol}", own, port)
        for robot in simulator.robots.values()
        for protocol, port in robot.ports.items()
    ]
    ports += [("status", own, simulator.status_port), ("rosbridge", own, simulator.rosbridge_port)]
    ports += [("backdoor", simulator.settings.backdoor_host, simulator.backdoor_port)]
    lines = [f"{what} on {host_and_port(host, port)}" for what, host, port in ports if port is not None]
    lines += [f"ROS node at {ros.ros1.node}"] if ros and ros.ros1 else []
    lines += [f"ROS 2 node {ros.ros2.node}"] if ros and ros.ros2 else []
    return [" ".join(f"{name} {line}".split()) for line in lines]


async def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens for the page. Raises Unusable."""
    need_library("viser", "view")
    return await open_listener(host, port)


def page_url(listening: socket.socket) -> str:
    """Return the address for a browser on this machine."""
    host, port = listening.getsockname()[:2]
    return f"http://{host_and_port(reached_at(host), port)}/"


@asynccontextmanager
async def _page(
    listening: socket.socket, settings: Settings, simulators: "dict[str, Simulator]"
) -> AsyncIterator[None]:
    """Have a process serve the page of all robots while the context is open."""
    task = {
        "listening": listening.fileno(),
        "places": [
            {
                "name": f"{name} {robot.name}".strip(),
                "in_cell": robot.name,
                "base": Frame.from_transform(robot.cell.base),
                "backdoor": (reached_at(each.settings.backdoor_host), each.backdoor_port),
                "token": word_of(each.settings.backdoor_token, each.settings.backdoor_token_file) or "",
                "driver": (reached_at(each.host), robot.ports[IIWA]) if IIWA in robot.ports else None,
            }
            for name, each in simulators.items()
            for robot in each.robots.values()
        ],
        "token": word_of(settings.view_token, settings.view_token_file),
        "log_level": settings.log_level,
        "log_json": settings.log_json,
    }
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "iiwa_sim.view.app"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.DEVNULL,
        pass_fds=(listening.fileno(),),
        start_new_session=True,  # the terminal's Ctrl-C is for this process
    )
    assert process.stdin is not None
    process.stdin.write(json.dumps(task).encode() + b"\n")
    listening.close()
    try:
        yield
    finally:
        process.stdin.close()
        try:
            await asyncio.wait_for(process.wait(), PAGE_ENDS_S)
        except TimeoutError:
            process.kill()
