"""The command `iiwa-sim` without a command's name: runs until a signal, or a bye that is to end it."""

import asyncio
import contextlib
import gc
import logging
import os
import resource
import signal
import sys
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from typing import TYPE_CHECKING

from iiwa_sim import log
from iiwa_sim.cli.output import reached_at, say
from iiwa_sim.cli.page import Page, page_url
from iiwa_sim.cli.parsing import from_command_line
from iiwa_sim.frames import Frame
from iiwa_sim.options.model import Settings
from iiwa_sim.options.robots import Robots, robots_of
from iiwa_sim.options.sources import from_environment, merged
from iiwa_sim.server.listening import host_and_port
from iiwa_sim.server.token import word_of

if TYPE_CHECKING:
    from iiwa_sim.cell.cell import Cell
    from iiwa_sim.simulator import Simulator

Cells = dict[tuple[str | None, str | None], "tuple[Cell, ...]"]
"""Files that have been read."""

logger = logging.getLogger(__name__)


def run(words: Sequence[str]) -> int:
    given = from_command_line(words)
    if "version" in given:
        from importlib import metadata

        say(f"iiwa-sim {metadata.version('iiwa-sim')}\n")
        return 0
    variables, warnings = from_environment(os.environ)
    robots = robots_of(merged(variables, given))
    common = robots[0][1]
    if sys.stderr is not None:
        log.configure(common.log_level, common.log_json, sys.stderr.fileno())
    for warning in warnings:
        logger.warning("environment variable %s", warning)
    with contextlib.suppress(OSError, ValueError):  # 500 robots open more files than the default of 1,024
        most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    asyncio.run(_serve(robots))
    return 0


async def _serve(robots: Robots) -> None:
    over = asyncio.Event()
    cells: Cells = {}
    page = None if robots[0][1].view_port is None else Page(robots[0][1])
    try:
        async with AsyncExitStack() as running:
            listening = None if page is None else running.enter_context(await page.listen())
            simulators = {name: _simulator(name, settings, cells, over.set) for name, settings in robots}
            for name, simulator in simulators.items():
                await running.enter_async_context(_entered(name, simulator))
            for number in (signal.SIGTERM, signal.SIGINT):
                asyncio.get_running_loop().add_signal_handler(number, over.set)
            lines = "".join(_announcement(name, simulator) for name, simulator in simulators.items())
            if page is not None and listening is not None:
                lines += f"page on {page_url(listening)}\n"
                places = [place for name, each in simulators.items() for place in _places(name, each)]
                await page.start(listening, places)
                running.push_async_callback(page.end)  # before the robots, or it would miss them
            say(lines)
            if sys.stderr is not None and sys.stderr.isatty():
                say(_banner(next(iter(simulators.values()))), sys.stderr)
            gc.freeze()  # long-lived objects are not scanned for garbage while the robot moves
            gc.enable()
            await over.wait()
    finally:
        gc.unfreeze()  # otherwise Ruckig's bindings complain at exit of objects left over


@asynccontextmanager
async def _entered(name: str, simulator: "Simulator") -> AsyncIterator[None]:
    with log.named(name):
        await simulator.__aenter__()
    try:
        yield
    finally:
        with log.named(name):
            await simulator.__aexit__(None, None, None)


def _simulator(name: str, settings: Settings, cells: Cells, end: Callable[[], None]) -> "Simulator":
    """Return the simulator of a robot, or of the robots in its cell."""
    # Pinocchio and Ruckig load slowly, so they are imported only when the options are known to be right.
    from iiwa_sim.simulator import Simulator

    place = settings.robot, settings.cell
    on_bye = end if settings.bye_shuts_down else None
    with log.named(name):
        simulator = Simulator(cell=cells.get(place), settings=settings, on_bye=on_bye)
    cells.setdefault(place, simulator.cells)
    return simulator


def _announcement(name: str, simulator: "Simulator") -> str:
    """Return the listening addresses, one line for each port."""
    own, bench = simulator.host, simulator.settings.backdoor_host
    ports: list[tuple[str, str, int | None]] = [
        (f"{robot.name} {'listening' if protocol == 'iiwa' else protocol}".lstrip(), own, port)
        for robot in simulator.robots.values()
        for protocol, port in robot.ports.items()
    ]
    ports += [("status", own, simulator.status_port), ("rosbridge", own, simulator.rosbridge_port)]
    ports += [("backdoor", bench, simulator.backdoor_port)]
    lines = [f"{what} on {host_and_port(host, port)}" for what, host, port in ports if port is not None]
    if simulator.ros_master is not None:
        lines.append(f"ROS node at {simulator.ros_master}")
    if simulator.ros2_node is not None:
        lines.append(f"ROS 2 node {simulator.ros2_node}")
    return "".join(f"{name} {line}\n".lstrip() for line in lines)


def _places(name: str, simulator: "Simulator") -> list[dict[str, object]]:
    """Return how the page reaches robots."""
    here, settings = reached_at(simulator.host), simulator.settings
    return [
        {
            "name": f"{name} {robot.name}".strip(),
            "in_cell": robot.name,
            "base": Frame.from_transform(robot.cell.base),
            "status": (here, simulator.status_port),
            "backdoor": (reached_at(settings.backdoor_host), simulator.backdoor_port),
            "token": word_of(settings.backdoor_token, settings.backdoor_token_file) or "",
            "driver": (here, robot.port) if robot.ports.get("iiwa") == robot.port else None,
        }
        for robot in simulator.robots.values()
    ]


def _banner(simulator: "Simulator") -> str:
    here, first = reached_at(simulator.host), next(iter(simulator.robots.values()))
    robot = " and ".join(each.cell.description.name for each in simulator.robots.values())
    protocol, port = next(iter(first.ports.items()))
    ways = {
        "iiwa": f"telnet {here} {port}, then type help",
        "krc4": f"""printf '<Cmd I0="1" I1="310"/>' | nc {here} {port}""",
    }
    return f"{robot}, simulated. To try it: {ways[protocol]}. Ctrl-C ends it.\n"
