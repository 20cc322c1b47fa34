"""How much of the time of a server one client may take."""

AT_ONCE_S = 0.005
"""What a client that was quiet may take without a pause."""
SHARE = 0.05


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
