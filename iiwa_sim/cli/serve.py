"""The command `iiwa-sim` without a subcommand: runs until a signal, or a bye that is to end it."""

import asyncio
import gc
import logging
import os
import sys
from collections.abc import Sequence
from contextlib import AsyncExitStack
from types import TracebackType
from typing import TYPE_CHECKING

from iiwa_sim import log
from iiwa_sim.backdoor.token import LOOPBACK
from iiwa_sim.cli.addresses import reached_at
from iiwa_sim.cli.descriptors import allow_descriptors
from iiwa_sim.cli.ending import Ending
from iiwa_sim.cli.environment import unknown_variables
from iiwa_sim.cli.fleet import Robot, descriptors_of, robots_of
from iiwa_sim.cli.options import ros_options
from iiwa_sim.cli.output import announce, say
from iiwa_sim.cli.page import Page
from iiwa_sim.cli.server_options import parsed, server_parser
from iiwa_sim.dialect.ports import DEFAULT_DIALECT
from iiwa_sim.serve import status_stream
from iiwa_sim.serve.listening import host_and_port

if TYPE_CHECKING:
    from iiwa_sim.cell.cell import Cell
    from iiwa_sim.simulator import Simulator

logger = logging.getLogger(__name__)


def run(given: Sequence[str]) -> int:
    options = parsed(given, os.environ)
    if options.version:
        from importlib import metadata

        say(f"iiwa-sim {metadata.version('iiwa-sim')}\n")
        return 0
    robots = robots_of(server_parser(), options)
    if sys.stderr is not None:
        log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    for name in unknown_variables(server_parser(), os.environ):
        logger.warning("the environment variable %s is no option of iiwa-sim: see iiwa-sim --help", name)
    if len(robots) > 1:
        allow_descriptors(len(robots), descriptors_of(robots))
    asyncio.run(_serve(robots))
    return 0


async def _serve(robots: list[Robot]) -> None:
    ending = Ending()
    cells: dict[tuple[str | None, str | None], Cell] = {}
    page = None if robots[0].options.view_port is None else Page(robots[0].options)
    try:
        async with AsyncExitStack() as running:
            if page is not None:
                await running.enter_async_context(page)
            named = [_Named(robot.name, _simulator(robot, cells, ending)) for robot in robots]
            for each in named:
                await running.enter_async_context(each)
            ending.watch()
            told = "".join(map(_announcement, named))
            if page is not None:
                page.places = [_place(each, robot) for each, robot in zip(named, robots, strict=True)]
                await page.start()
                running.push_async_callback(page.end)  # before the robots, or it would miss them
                told += f"page on {page.url}\n"
            announced = [announce(told, sys.stdout)]
            if sys.stderr is not None and sys.stderr.isatty():
                announced.append(announce(_banner(named[0].simulator), sys.stderr))
            gc.freeze()  # long-lived objects are not scanned for garbage while the robot moves
            gc.enable()
            await ending.wait(*announced)
    finally:
        gc.unfreeze()  # otherwise Ruckig's bindings complain at exit of objects left over


class _Named:
    """A simulator whose start, run and end are logged under its name."""

    def __init__(self, name: str, simulator: "Simulator") -> None:
        self.name = name
        self.simulator = simulator

    async def __aenter__(self) -> None:
        before = log.robot.set(self.name)
        try:
            await self.simulator.__aenter__()
        finally:
            log.robot.reset(before)

    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        before = log.robot.set(self.name)
        try:
            await self.simulator.__aexit__(kind, fault, where)
        finally:
            log.robot.reset(before)


def _simulator(
    robot: Robot, cells: "dict[tuple[str | None, str | None], Cell]", ending: Ending
) -> "Simulator":
    """The simulator for a robot's options; `cells` caches files that have been read."""
    # Pinocchio and Ruckig load slowly, so they are imported only when the options are known to be right.
    from iiwa_sim.simulator import Simulator

    options = robot.options
    known = cells.get((options.robot, options.cell))
    before = log.robot.set(robot.name)
    try:
        simulator = Simulator(
            options.robot if known is None else None,
            cell=known or options.cell,
            dialects=options.dialect,
            port=options.port,
            rate_hz=options.rate,
            clock=options.clock,
            servo_timeout_s=options.servo_timeout,
            status_port=options.status_port,
            status_rate_hz=options.status_rate or status_stream.DEFAULT_RATE_HZ,
            **ros_options(options)._asdict(),
            strict=options.strict,
            exclusive=options.exclusive,
            reconnect_pause_s=options.reconnect_pause,
            backdoor_port=options.backdoor_port,
            backdoor_http_port=options.backdoor_http_port,
            backdoor_host=options.backdoor_host or LOOPBACK,
            backdoor_token=options.backdoor_token or options.backdoor_token_file,
            transcript=options.transcript,
            record=options.record,
            record_rate_hz=options.record_rate,
            on_bye=ending.asked.set if options.bye_shuts_down else None,
        )
    finally:
        log.robot.reset(before)
    cells.setdefault((options.robot, options.cell), simulator.cell)
    return simulator


def _announcement(named: _Named) -> str:
    """The listening addresses, one line for each port."""
    simulator = named.simulator
    places = {
        "listening" if name == DEFAULT_DIALECT else name: (simulator.host, port)
        for name, port in simulator.ports.items()
    }
    if simulator.status_port is not None:
        places["status"] = (simulator.host, simulator.status_port)
    if simulator.rosbridge_port is not None:
        places["rosbridge"] = (simulator.host, simulator.rosbridge_port)
    lines = [f"{what} on {host_and_port(*place)}\n" for what, place in places.items()]
    if simulator.ros_master is not None:
        lines.append(f"ROS node at {simulator.ros_master}\n")
    if simulator.ros2_node is not None:
        lines.append(f"ROS 2 node {simulator.ros2_node}\n")
    if simulator.backdoor_port is not None:
        lines.append(f"backdoor on {host_and_port(simulator.backdoor_host, simulator.backdoor_port)}\n")
    if simulator.backdoor_http_port is not None:
        address = host_and_port(simulator.backdoor_host, simulator.backdoor_http_port)
        lines.append(f"backdoor by HTTP on {address}\n")
    return "".join(f"{named.name} {line}" if named.name else line for line in lines)


def _place(named: _Named, robot: Robot) -> dict[str, object]:
    """Where the page reaches a robot."""
    simulator, options = named.simulator, robot.options
    here = reached_at(simulator.host)
    port = simulator.ports.get(DEFAULT_DIALECT)
    return {
        "name": named.name,
        "status": (here, simulator.status_port),
        "backdoor": (reached_at(simulator.backdoor_host), simulator.backdoor_port),
        "token": options.backdoor_token or options.backdoor_token_file or "",
        "driver": None if port is None else (here, port),
    }


def _banner(simulator: "Simulator") -> str:
    here, robot = reached_at(simulator.host), simulator.cell.description.name
    ways = {
        "iiwa": "telnet {here} {port}, then type help",
        "krc4": """printf '<Cmd I0="1" I1="310"/>' | nc {here} {port}""",
    }
    first, port = next(iter(simulator.ports.items()))
    return f"{robot}, simulated. To try it: {ways[first].format(here=here, port=port)}. Ctrl-C ends it.\n"
