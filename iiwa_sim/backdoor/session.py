"""The backdoor's line protocol: lines of one connection in, calls on the backdoor, replies out.

Lines and replies are as on the main port, one reply per line in order. A refusal is answered `error CODE
REASON` and does not show on the main port. Lines after an `advance` or `run until stopped` wait for it. If
there is a token, it has to be the first line; anything else there ends the connection.
"""

import asyncio
from collections.abc import Coroutine

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.line_calls import BYE, RELEASE_WHEN_GONE, LineCalls
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.protocols.lines import OVERLONG
from iiwa_sim.protocols.session import LineSession, ProtocolLog, written
from iiwa_sim.protocols.table import ERROR
from iiwa_sim.server.token import Token
from iiwa_sim.wording import harmless

_LINES_AT_ONCE = 64
_WELCOME = "done"
_NO_TOKEN = "the first line is not the token"


class BackdoorSession(LineSession):
    """One connection to the backdoor. To be used inside an asyncio loop in which time passes."""

    def __init__(self, backdoor: Backdoor, log: ProtocolLog, name: str, token: Token | None = None) -> None:
        """`name` identifies this connection in the log; without a `token` none is expected."""
        super().__init__(log, name)
        self._backdoor = backdoor
        self._calls = LineCalls(backdoor, log, name)
        self._releases = False  # when the connection goes
        self._token = token  # until it has been received
        self._taking_time: asyncio.Task[str] | None = None  # for the first of the lines that wait

    def answer(self, most: int = _LINES_AT_ONCE) -> bytes:
        r"""The replies to the next waiting lines, each with its `\r\n`, up to a line that takes time."""
        return super().answer(most)

    def lost(self) -> None:
        """Notice that the connection has gone: its effects remain, but for pushes, where the client has asked
        for that, and a pending `advance` ends."""
        super().lost()
        if self._releases:
            self._releases = False
            self._backdoor.release()
        if self._taking_time is not None:
            self._taking_time.cancel()
            self._taking_time = self.pending = None

    def _reply(self, line: bytes) -> bytes:
        if self._token is not None:
            return self._admitted(self._token, line)
        try:
            with self._calls.telling(line):
                reply = self._outcome(line)
        except Refused as refused:
            return _error(refused)
        if isinstance(reply, str):
            self._calls.done(line, reply)
            return written(reply)
        self.pending = self._taking_time = asyncio.get_running_loop().create_task(reply)
        self.waiting.appendleft(line)
        self.ends_batch = True
        return b""

    def _outcome(self, line: bytes) -> str | Coroutine[None, None, str]:
        """The reply to a line, or what to await for it. Raises what the call raises."""
        if self._taking_time is not None:  # and is done: the line waited for that
            task, self._taking_time, self.pending = self._taking_time, None, None
            return task.result()
        request = self._calls.parse(line)
        if request.command.name == BYE:
            self.close()
        if request.command.name == RELEASE_WHEN_GONE:
            self._releases = True
        return self._calls.start(request, line)

    def _admitted(self, token: Token, line: bytes) -> bytes:
        if line is not OVERLONG and token.fits(line):
            self._token = None
            return written(_WELCOME)
        self.close()
        # the line may be a misspelt token, so it is not logged
        self.log.refused(self.name, "(not shown)", COMMUNICATION_FAILURE, _NO_TOKEN)
        return _error(Refused(COMMUNICATION_FAILURE, _NO_TOKEN))


def _error(refused: Refused) -> bytes:
    return written(f"{ERROR} {refused.code} {harmless(refused.reason)}")
