"""The command `iiwa-sim` without a command's name: runs until a signal, or a bye that is to end it."""

import asyncio
import contextlib
import gc
import logging
import os
import resource
import signal
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

from iiwa_sim import log
from iiwa_sim.cli.page import listen, page_process, page_url
from iiwa_sim.cli.parsing import from_command_line, reached_at
from iiwa_sim.frames import Frame
from iiwa_sim.options.robots import Robots, robots_of
from iiwa_sim.options.sources import from_environment, merged
from iiwa_sim.server.listening import host_and_port
from iiwa_sim.server.token import word_of

if TYPE_CHECKING:
    from iiwa_sim.cell.cell import Cell
    from iiwa_sim.simulator import Simulator

logger = logging.getLogger(__name__)


def run(words: Sequence[str]) -> int:
    given = from_command_line(words)
    if "version" in given:
        from importlib import metadata

        print(f"iiwa-sim {metadata.version('iiwa-sim')}")
        return 0
    variables, warnings = from_environment(os.environ)
    robots = robots_of(merged(variables, given))
    common = next(iter(robots.values()))
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
    common = next(iter(robots.values()))
    try:
        async with AsyncExitStack() as running:
            page = None
            if common.view_port is not None:
                page = running.enter_context(await listen(common.view_host, common.view_port))
            simulators = _simulators(robots, over.set)
            for name, simulator in simulators.items():
                with log.named(name):
                    await running.enter_async_context(simulator)
            for number in (signal.SIGTERM, signal.SIGINT):
                asyncio.get_running_loop().add_signal_handler(number, over.set)
            lines = [line for name, each in simulators.items() for line in _announcement(name, each)]
            if page is not None:
                lines.append(f"page on {page_url(page)}")
                places = [place for name, each in simulators.items() for place in _places(name, each)]
                # It ends before the robots, or it would miss them.
                await running.enter_async_context(page_process(page, common, places))
            print(*lines, sep="\n", flush=True)
            gc.freeze()  # long-lived objects are not scanned for garbage while the robot moves
            gc.enable()
            await over.wait()
    finally:
        gc.unfreeze()  # otherwise Ruckig's bindings complain at exit of objects left over


def _simulators(robots: Robots, end: Callable[[], None]) -> "dict[str, Simulator]":
    """Return the simulators by their names. Each file is read once for equal robots."""
    # Pinocchio and Ruckig load slowly, so they are imported only when the options are known to be right.
    from iiwa_sim.simulator import Simulator

    cells: dict[object, tuple[Cell, ...]] = {}
    simulators: dict[str, Simulator] = {}
    for name, settings in robots.items():
        place, on_bye = (settings.robot, settings.cell), end if settings.bye_shuts_down else None
        with log.named(name):
            simulators[name] = Simulator(cell=cells.get(place), settings=settings, on_bye=on_bye)
        cells.setdefault(place, simulators[name].cells)
    return simulators


def _announcement(name: str, simulator: "Simulator") -> Iterable[str]:
    """Return the listening addresses, one line for each port."""
    own, settings = simulator.host, simulator.settings
    ports: list[tuple[str, str, int | None]] = [
        (f"{robot.name} {'listening' if protocol == 'iiwa' else protocol}".lstrip(), own, port)
        for robot in simulator.robots.values()
        for protocol, port in robot.ports.items()
    ]
    ports += [("status", own, simulator.status_port), ("rosbridge", own, simulator.rosbridge_port)]
    ports += [("backdoor", settings.backdoor_host, simulator.backdoor_port)]
    lines = [f"{what} on {host_and_port(host, port)}" for what, host, port in ports if port is not None]
    if simulator.ros is not None and simulator.ros.ros1 is not None:
        lines.append(f"ROS node at {simulator.ros.ros1.node}")
    if simulator.ros is not None and simulator.ros.ros2 is not None:
        lines.append(f"ROS 2 node {simulator.ros.ros2.node}")
    return [f"{name} {line}".lstrip() for line in lines]


def _places(name: str, simulator: "Simulator") -> list[dict[str, object]]:
    """Return how the page reaches robots."""
    here, settings = reached_at(simulator.host), simulator.settings
    return [
        {
            "name": f"{name} {robot.name}".strip(),
            "in_cell": robot.name,
            "base": Frame.from_transform(robot.cell.base),
            "backdoor": (reached_at(settings.backdoor_host), simulator.backdoor_port),
            "token": word_of(settings.backdoor_token, settings.backdoor_token_file) or "",
            "driver": (here, robot.port) if robot.ports.get("iiwa") == robot.port else None,
        }
        for robot in simulator.robots.values()
    ]
