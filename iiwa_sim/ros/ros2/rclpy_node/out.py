"""The lines that the node's process writes."""

import json
import os
import threading
from typing import Any

LONGEST_BYTES = 1 << 20
"""A trajectory of 2,000 points with all they can have fits."""


class Out:
    """Standard output, for several threads; what libraries print goes to standard error."""

    def __init__(self) -> None:
        self._stream = os.fdopen(os.dup(1), "w", encoding="utf-8")
        os.dup2(2, 1)
        self._lock = threading.Lock()

    def tell(self, **what: Any) -> None:
        """Write one line; of a message that is too long only how long it is."""
        text = json.dumps(what)
        if len(text) > LONGEST_BYTES:
            rest = {key: value for key, value in what.items() if key not in ("msg", "request")}
            text = json.dumps({**rest, "long": len(text)})
        with self._lock:
            self._stream.write(text + "\n")
            self._stream.flush()
