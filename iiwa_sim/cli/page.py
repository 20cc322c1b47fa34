"""The page: served by a command, or by a process beside the simulator that ends with it."""

import asyncio
import contextlib
import importlib.util
import json
import logging
import signal
import socket
import sys
import threading
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Any

from iiwa_sim import log
from iiwa_sim.cli.parsing import reached_at
from iiwa_sim.options.model import Settings
from iiwa_sim.server.listening import host_and_port, open_listener
from iiwa_sim.server.token import Token, word_of
from iiwa_sim.wording import Unusable

ENDS_S = 5.0
"""Seconds that the process of the page has to end, before it is killed."""

logger = logging.getLogger(__name__)


async def listen(settings: Settings) -> socket.socket:
    """Return a socket that listens for the page. Raises Unusable."""
    if importlib.util.find_spec("viser") is None:
        raise Unusable("the page needs viser: pip install -e '.[view]'")
    return await open_listener(settings.view_host, settings.view_port or 0)


def page_url(listening: socket.socket) -> str:
    """Return the address for a browser on this machine."""
    host, port = listening.getsockname()[:2]
    return f"http://{host_and_port(reached_at(host), port)}/"


def serve(
    settings: Settings,
    run: Callable[[socket.socket, threading.Event, Token | None, Callable[[], None]], None],
) -> None:
    """Have `run` serve a page until SIGTERM or SIGINT. Raises Unusable.

    `run` takes a socket that listens, the event of the end, the token, and a function to call when it serves.
    """
    log.configure(settings.log_level, settings.log_json, sys.stderr.fileno())
    over, stdout = threading.Event(), sys.stdout  # viser's own words go nowhere
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: over.set())
    word = word_of(settings.view_token, settings.view_token_file)
    with asyncio.run(listen(settings)) as listening:
        line = f"page on {page_url(listening)}"
        token = None if word is None else Token(word)
        run(listening, over, token, lambda: print(line, file=stdout, flush=True))


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
