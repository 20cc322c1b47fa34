"""The page in a process beside the simulator, which ends with it."""

import asyncio
import contextlib
import importlib.util
import json
import logging
import socket
import sys
from collections.abc import AsyncIterator, Sequence
from typing import Any

from iiwa_sim.cli.parsing import reached_at
from iiwa_sim.options.model import Settings
from iiwa_sim.server.listening import host_and_port, open_listener
from iiwa_sim.server.token import word_of
from iiwa_sim.wording import Unusable

ENDS_S = 5.0
"""Seconds that the process of the page has to end, before it is killed."""

logger = logging.getLogger(__name__)


async def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens for the page. Raises Unusable."""
    if importlib.util.find_spec("viser") is None:
        raise Unusable("the page needs viser: pip install -e '.[view]'")
    return await open_listener(host, port)


def page_url(listening: socket.socket) -> str:
    """Return the address for a browser on this machine."""
    host, port = listening.getsockname()[:2]
    return f"http://{host_and_port(reached_at(host), port)}/"


@contextlib.asynccontextmanager
async def page_process(
    listening: socket.socket, settings: Settings, places: Sequence[dict[str, Any]]
) -> AsyncIterator[None]:
    """Have a process serve the page while the context is open, for `places` of `iiwa_sim.view.connection`.

    A page that fails is a warning in the log.
    """
    task = {
        "listening": listening.fileno(),
        "places": places,
        "token": word_of(settings.view_token, settings.view_token_file),
        "log_level": settings.log_level,
        "log_json": settings.log_json,
    }
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "iiwa_sim.view"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.DEVNULL,
        pass_fds=(listening.fileno(),),
    )
    assert process.stdin is not None
    process.stdin.write(json.dumps(task).encode() + b"\n")
    listening.close()

    async def watch() -> None:
        code = await process.wait()
        logger.warning("the page has ended with exit code %d: the robot goes on without it", code)

    watching = asyncio.create_task(watch())
    try:
        yield
    finally:
        watching.cancel()
        process.stdin.close()
        try:
            await asyncio.wait_for(process.wait(), ENDS_S)
        except TimeoutError:
            process.kill()
