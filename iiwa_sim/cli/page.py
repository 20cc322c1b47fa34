"""The page as a process beside the simulator: started with it, and ended with it."""

import asyncio
import importlib.util
import json
import logging
import signal
import socket
import sys
import threading
from collections.abc import Callable
from typing import Any

from iiwa_sim import log
from iiwa_sim.cli.output import reached_at, say
from iiwa_sim.options.model import Settings
from iiwa_sim.server.listening import host_and_port, open_listener
from iiwa_sim.server.token import Token, word_of
from iiwa_sim.wording import Unusable

ENDS_S = 5.0
"""How long the process of the page may take to end in good order (s), before it is killed."""

logger = logging.getLogger(__name__)


def check_library() -> None:
    """Raises Unusable where the page cannot be served."""
    if importlib.util.find_spec("viser") is None:
        raise Unusable("the page needs viser: pip install -e '.[view]'")


def page_url(listening: socket.socket) -> str:
    """Return the address for a browser on this machine."""
    host, port = listening.getsockname()[:2]
    return f"http://{host_and_port(reached_at(host), port)}/"


def serve(
    settings: Settings,
    run: Callable[[socket.socket, threading.Event, Token | None, Callable[[], None]], None],
) -> None:
    """Have `run` serve a page until SIGTERM or SIGINT. Raises Unusable.

    `run` takes a socket that listens, what ends it, the token, and what it calls when the page is there.
    """
    log.configure(settings.log_level, settings.log_json, sys.stderr.fileno())
    over, stdout = threading.Event(), sys.stdout  # viser's own words go nowhere
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: over.set())
    word = word_of(settings.view_token, settings.view_token_file)
    with asyncio.run(open_listener(settings.view_host, settings.view_port or 0)) as listening:
        token = None if word is None else Token(word)
        run(listening, over, token, lambda: say(f"page on {page_url(listening)}\n", stdout))


class Page:
    """A port from `listen` on, and a process that serves the page there from `start` to `end`.

    A browser that comes before `start` waits. A page that fails later is a warning in the log.
    """

    def __init__(self, settings: Settings) -> None:
        """Raises Unusable."""
        check_library()
        self._settings = settings
        self._process: asyncio.subprocess.Process | None = None
        self._watching: asyncio.Task[None] | None = None
        self._ending = False

    async def listen(self) -> socket.socket:
        """Return a socket that listens, for `start`. Raises ListenFault."""
        return await open_listener(self._settings.view_host, self._settings.view_port or 0)

    async def start(self, listening: socket.socket, places: list[dict[str, Any]]) -> None:
        """Serve robots that have opened their ports, each as `iiwa_sim.view.connection.Place`."""
        task = {
            "listening": listening.fileno(),
            "places": places,
            "token": word_of(self._settings.view_token, self._settings.view_token_file),
            "log_level": self._settings.log_level,
            "log_json": self._settings.log_json,
        }
        self._process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "iiwa_sim.view"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.DEVNULL,
            pass_fds=(listening.fileno(),),
        )
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(task).encode() + b"\n")
        listening.close()
        self._watching = asyncio.create_task(self._watch(self._process))

    async def end(self) -> None:
        """Have the process end, and wait for that."""
        assert self._process is not None
        assert self._process.stdin is not None
        assert self._watching is not None
        self._ending = True
        self._process.stdin.close()
        try:
            await asyncio.wait_for(self._watching, ENDS_S)
        except TimeoutError:
            self._process.kill()
            await self._process.wait()

    async def _watch(self, process: asyncio.subprocess.Process) -> None:
        code = await process.wait()
        if not self._ending:
            logger.warning("the page has ended with exit code %d: the robot goes on without it", code)
