"""The page as a process beside the simulator: started with it, and ended with it."""

import argparse
import asyncio
import importlib.util
import json
import logging
import socket
import sys
from types import TracebackType
from typing import Any, Self

from iiwa_sim.backdoor.token import LOOPBACK, Token, check_reach
from iiwa_sim.cli.options import secret_in
from iiwa_sim.cli.parsing import Parser, whole
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
    return f"http://{host_and_port({'0.0.0.0': '127.0.0.1', '::': '::1'}.get(host, host), port)}/"


def add_page(parser: Parser) -> None:
    """Options of a command that serves a page itself: where it listens, and for whom."""
    parser.add_argument(
        "--host",
        default=LOOPBACK,
        help="address for the page to listen on; one that other machines reach, such as 0.0.0.0, needs a "
        "token (default: %(default)s)",
    )
    parser.add_argument(
        "--port",
        type=whole(0, MAX_PORT),
        default=DEFAULT_PORT,
        help="port for the page to listen on; 0 picks one (default: %(default)s)",
    )
    parser.add_argument(
        "--token",
        metavar="TOKEN",
        help="let only browsers in that know it. Other users of this machine can read it in the list of "
        "processes (default: none)",
    )
    parser.add_argument(
        "--token-file", type=secret_in, metavar="FILE", help="the same, with the token in this file"
    )


def page_token(parser: Parser, options: argparse.Namespace) -> Token | None:
    """The token that browsers have to send, None for none; wrong options end the program."""
    if options.token is not None and options.token_file is not None:
        parser.error("argument --token-file: expected no --token with it")
    text = options.token if options.token is not None else options.token_file
    try:
        token = None if text is None else Token(text)
        check_reach(options.host, token, "page", "--token-file")
    except ValueError as fault:
        parser.error(f"argument --{'host' if text is None else 'token'}: {fault}")
    return token


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
