"""`iiwa-sim show`: plays a recording on a web page, with a time line."""

import asyncio
import signal
import sys
import threading
from collections.abc import Sequence

from iiwa_sim import log
from iiwa_sim.cli.names import SHOW
from iiwa_sim.cli.options import add_log
from iiwa_sim.cli.output import say
from iiwa_sim.cli.page import add_page, check_library, page_token, page_url
from iiwa_sim.cli.parsing import Parser, path
from iiwa_sim.cli.recordings import opened, tell_cut
from iiwa_sim.serve.listening import open_listener


def run(given: Sequence[str]) -> int:
    parser = _parser()
    options = parser.parse_args(given)
    token = page_token(parser, options)
    opened(options.recording)  # whether it is one, before the page is loaded
    check_library()
    log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    over = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: over.set())
    from iiwa_sim.recordings.timeline import Timeline
    from iiwa_sim.view.playback import run_playback

    timeline = Timeline(options.recording)
    tell_cut(timeline)
    with asyncio.run(open_listener(options.host, options.port)) as listening:
        stdout = sys.stdout  # viser's own words go nowhere
        run_playback(
            listening, timeline, over, token, lambda: say(f"page on {page_url(listening)}\n", stdout)
        )
    return 0


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {SHOW}",
        description="Serves a web page on which a recording plays: the robot, its dialogue and events, "
        "with a time line.",
        epilog="It needs the extras record and view. Exit code 0 after SIGTERM or SIGINT.",
        examples={"run.mcap": "what was recorded with --record, on http://127.0.0.1:8080/"},
    )
    parser.add_argument("recording", type=path, metavar="FILE.mcap", help="a recording of --record")
    add_page(parser)
    add_log(parser)
    return parser
