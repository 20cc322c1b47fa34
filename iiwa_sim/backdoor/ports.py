"""The ports of a backdoor: one for lines, one for HTTP, or none."""

from typing import TYPE_CHECKING

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.recent_dialogue import RecentDialogue
from iiwa_sim.backdoor.session import BackdoorSession
from iiwa_sim.options.model import Settings
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.server import close_all, start_all
from iiwa_sim.server.tcp import TcpServer
from iiwa_sim.server.token import Token, word_of
from iiwa_sim.wording import Unusable

if TYPE_CHECKING:
    from iiwa_sim.server.http import HttpServer

HTTP_LIBRARY = "h11"


class HttpFault(Unusable):
    """The library for HTTP is not installed. The message is one line."""


class BackdoorPorts:
    """The listening ports, from `start` to `close`."""

    def __init__(
        self,
        backdoor: Backdoor,
        recent: RecentDialogue,
        log: ProtocolLog,
        settings: Settings,
        budget: Budget,
    ) -> None:
        """Raises HttpFault without the library for HTTP."""
        self._backdoor = backdoor
        self._recent = recent
        self._log = log
        word = word_of(settings.backdoor_token, settings.backdoor_token_file)
        self._token = None if word is None else Token(word)
        self._lines: TcpServer | None = None
        self._http: HttpServer | None = None
        host, port, http_port = (
            settings.backdoor_host,
            settings.backdoor_port,
            settings.backdoor_http_port,
        )
        if port is not None or http_port is not None:
            recent.listen()
        if port is not None:
            self._lines = TcpServer(self._open_session, host, port, budget=budget)
        if http_port is not None:
            self._http = self._http_server(host, http_port, budget)

    async def start(self) -> None:
        """Start listening. Raises ListenFault, and then nothing is left open."""
        await start_all(self._servers)

    async def close(self) -> None:
        """Stop listening and close every connection."""
        await close_all(self._servers)

    @property
    def _servers(self) -> "list[TcpServer | HttpServer]":
        return [server for server in (self._lines, self._http) if server is not None]

    @property
    def port(self) -> int | None:
        """The port for lines, if there is one."""
        return None if self._lines is None else self._lines.address[1]

    @property
    def http_port(self) -> int | None:
        """The port for HTTP, if there is one."""
        return None if self._http is None else self._http.address[1]

    @property
    def host(self) -> str:
        """The address of both. Raises RuntimeError where there is none."""
        server = self._lines or self._http
        if server is None:
            raise RuntimeError("the backdoor has no port")
        return server.address[0]

    def _open_session(self, name: str) -> BackdoorSession:
        return BackdoorSession(self._backdoor, self._log, f"{name} (backdoor)", self._token)

    def _http_server(self, host: str, port: int, budget: Budget) -> "HttpServer":
        try:
            from iiwa_sim.backdoor.http import BackdoorHttp
            from iiwa_sim.server.http import HttpServer
        except ModuleNotFoundError as fault:
            if fault.name != HTTP_LIBRARY:
                raise
            raise HttpFault(f"the backdoor by HTTP needs {HTTP_LIBRARY}: pip install -e '.[http]'") from None
        front = BackdoorHttp(self._backdoor, self._recent, self._log, self._token)
        return HttpServer(front.answer, host, port, budget=budget)
