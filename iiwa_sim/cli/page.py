"""The page as a process beside the simulator: started with it, and ended with it."""

import argparse
import asyncio
import importlib.util
import json
import logging
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, NamedTuple, Self

from iiwa_sim import log
from iiwa_sim.cli.addresses import reached_at
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser, whole
from iiwa_sim.cli.reach import PAGE, add_reach
from iiwa_sim.dialect.ports import MAX_PORT
from iiwa_sim.serve.listening import host_and_port, open_listener
from iiwa_sim.wording import Unusable

DEFAULT_PORT = 8080
ENDS_S = 5.0
"""How long the process of the page may take to end in good order (s), before it is killed."""
_LIBRARY = "viser"

logger = logging.getLogger(__name__)


class LibraryFault(Unusable):
    """The library for the page is not installed. The message is one line."""


def check_library() -> None:
    """Raises LibraryFault where the page cannot be served."""
    if importlib.util.find_spec(_LIBRARY) is None:
        raise LibraryFault(f"the page needs {_LIBRARY}: pip install 'iiwa-sim[view]'")


def page_url(listening: socket.socket) -> str:
    """What to open in a browser on this machine."""
    host, port = listening.getsockname()[:2]
    return f"http://{host_and_port(reached_at(host), port)}/"


def add_page(parser: Parser) -> None:
    """Options of a command that serves a page itself: where it listens, and for whom."""
    add_reach(parser, "", PAGE)
    parser.add_argument(
        "--port",
        type=whole(0, MAX_PORT),
        default=DEFAULT_PORT,
        help="port for the page to listen on; 0 picks one (default: %(default)s)",
    )


class Served(NamedTuple):
    """A page that a command serves itself."""

    listening: socket.socket
    over: threading.Event
    """Set by SIGTERM and SIGINT."""
    announce: Callable[[], None]
    """Tells on stdout where it is, once it is there."""


@contextmanager
def served(options: argparse.Namespace) -> Iterator[Served]:
    """What a command needs to serve a page until it is told to end. Raises LibraryFault and ListenFault."""
    check_library()
    log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    over, stdout = threading.Event(), sys.stdout  # viser's own words go nowhere
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: over.set())
    with asyncio.run(open_listener(options.host, options.port)) as listening:
        yield Served(listening, over, lambda: say(f"page on {page_url(listening)}\n", stdout))


class Page:
    """A port while the context is open, and a process that serves the page there from `start` to `end`.

    The port is taken at once, so a browser that comes early waits; what fails later is told in the log, and
    the robot goes on without it.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        """`options` are those of the command line. Raises LibraryFault."""
        check_library()
        self.places: list[dict[str, Any]] = []
        """The robots to show, as `iiwa_sim.view.station.Place`, to be filled before it is started."""
        self.url = ""
        """What to open in a browser on this machine, once it listens."""
        self._options = options
        self._listening: socket.socket | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._watching: asyncio.Task[None] | None = None
        self._ending = False

    async def __aenter__(self) -> Self:
        """Listen. Raises ListenFault."""
        self._listening = await open_listener(self._options.view_host, self._options.view_port)
        self.url = page_url(self._listening)
        return self

    async def start(self) -> None:
        """Serve: the robots have opened their ports."""
        assert self._listening is not None
        options = self._options
        task = {
            "listening": self._listening.fileno(),
            "places": self.places,
            "token": options.view_token if options.view_token is not None else options.view_token_file,
            "log_level": options.log_level,
            "log_json": options.log_json,
        }
        self._process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "iiwa_sim.view"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.DEVNULL,
            pass_fds=(self._listening.fileno(),),
        )
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(task).encode() + b"\n")
        self._listening.close()
        self._watching = asyncio.create_task(self._watch(self._process))

    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        if self._listening is not None:
            self._listening.close()

    async def end(self) -> None:
        """Have the process end, and wait for that."""
        self._ending = True
        if self._process is None or self._watching is None:
            return
        assert self._process.stdin is not None
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
