"""What somebody does on the page, done: refusals go to who did it, and no failure goes any further."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import Any

from iiwa_sim.throttle import Throttle
from iiwa_sim.view.line_client import Refusal, Unanswered

REFUSAL_SHOWN_S = 8.0

logger = logging.getLogger(__name__)
_told = Throttle[str](1)


def acting(action: Callable[[Any], object]) -> Callable[[Any], None]:
    """A callback for viser, which calls it in a thread of its own with an event.

    Nothing is done at values that the page itself has set, which viser tells, too.
    """

    def call(event: Any) -> None:
        if event.client is None:
            return
        try:
            action(event)
        except Refusal as refusal:
            tell(event.client, "Refused", str(refusal))
        except Unanswered as fault:
            tell(event.client, "No answer", str(fault))
        except Exception as fault:  # noqa: BLE001 - at whatever a browser has sent
            if _told.count("acting", time.monotonic_ns()) is not None:
                logger.warning("page: a request of a browser failed: %s %s", type(fault).__name__, fault)

    return call


def tell(client: Any, title: str, text: str) -> None:
    """Show one viewer a few words."""
    client.add_notification(title, text, color="red", auto_close_seconds=REFUSAL_SHOWN_S)
