"""How much of the time of a server one client may take."""

import threading
from collections import OrderedDict

AT_ONCE_S = 0.005
"""What a client that was quiet may take without a pause."""
SHARE = 0.05

MOST_CLIENTS = 1000
"""That are told from each other by name."""


class Allowance:
    """That of one client: a share of the time, and a little at once.

    However short or long its messages are: in any interval the client takes no more than `SHARE` of it,
    `AT_ONCE_S`, and the message that went beyond.
    """

    def __init__(self) -> None:
        self._owed_s = 0.0
        self._at_s = 0.0

    def rest_s(self, took_s: float, now_s: float) -> float:
        """For how long not to listen to the client, one of whose messages has just taken so long."""
        self._owed_s = max(0.0, self._owed_s - SHARE * (now_s - self._at_s)) + took_s
        self._at_s = now_s
        return max(0.0, self._owed_s - AT_ONCE_S) / SHARE


class Allowances:
    """Those of clients that are heard in several threads at once, by name: of the last `MOST_CLIENTS`."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._clients: OrderedDict[str, Allowance] = OrderedDict()

    def rest_s(self, client: str, took_s: float, now_s: float) -> float:
        """As of `Allowance`. Who has several messages on the way rests the longer after each."""
        with self._lock:
            allowance = self._clients.setdefault(client, Allowance())
            self._clients.move_to_end(client)
            if len(self._clients) > MOST_CLIENTS:
                self._clients.popitem(last=False)
            return allowance.rest_s(took_s, now_s)
