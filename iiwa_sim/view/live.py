"""The live page: robots that are followed, drawn 30 times a second for whoever has it open."""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack

from iiwa_sim.server.token import Token
from iiwa_sim.throttle import Throttle
from iiwa_sim.view.hall import MOST, Hall
from iiwa_sim.view.page import open_page
from iiwa_sim.view.station import Place, Station

FRAME_S = 1.0 / 30.0
IDLE_S = 0.1
"""Time between two looks whether somebody has opened the page."""

logger = logging.getLogger(__name__)


def run_page(
    listening: socket.socket,
    places: Sequence[Place],
    over: threading.Event,
    token: Token | None = None,
    opened: Callable[[], None] = lambda: None,
) -> None:
    """Show robots on a page at a socket that listens, until `over` is set; `opened` is called when it serves.

    Raises StationFault or RobotFault, before that, for a robot that is not there or cannot be drawn.
    """
    if len(places) > MOST:
        logger.warning("the page shows the first %d of %d robots", MOST, len(places))
    stations = [Station(place) for place in places[:MOST]]
    drawings = [station.describe() for station in stations]
    with ExitStack() as running:
        server = running.enter_context(open_page(listening, token))
        hall = Hall(server, stations, drawings)
        for station in stations:
            station.start()
            running.callback(station.stop)
        running.enter_context(hall)
        opened()
        told = Throttle[str](1)
        while not over.is_set():
            wanted = bool(server.get_clients())
            for station in stations:
                station.want(wanted)
            if not wanted:
                over.wait(IDLE_S)
                continue
            began_s = time.monotonic()
            try:
                with server.atomic():
                    hall.frame()
            except Exception as fault:
                # A page that fails at a state is worth a line, and the next state a try.
                if told.count("frame", time.monotonic_ns()) is not None:
                    logger.exception("the page cannot show a state: %s", fault)
            over.wait(max(FRAME_S - (time.monotonic() - began_s), 0.0))
