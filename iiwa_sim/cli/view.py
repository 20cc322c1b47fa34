"""`iiwa-sim view`: the live page of a robot that runs elsewhere."""

import asyncio
import signal
import sys
import threading
from collections.abc import Sequence

from iiwa_sim import log
from iiwa_sim.cli.names import VIEW
from iiwa_sim.cli.options import add_log, add_robot, add_server, secret_in, server_address
from iiwa_sim.cli.output import say
from iiwa_sim.cli.page import add_page, check_library, page_token, page_url
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.serve.listening import open_listener


def run(given: Sequence[str]) -> int:
    parser = _parser()
    options = parser.parse_args(given)
    token = page_token(parser, options)
    check_library()
    log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    over = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: over.set())
    with asyncio.run(open_listener(options.host, options.port)) as listening:
        from iiwa_sim.view.live import run_page
        from iiwa_sim.view.station import Place

        place = Place(
            status=options.server,
            backdoor=options.backdoor,
            token=options.backdoor_token_file or "",
            driver=options.driver,
            robot=options.robot,
        )
        stdout = sys.stdout  # viser's own words go nowhere
        run_page(
            listening,
            [place],
            over,
            token,
            lambda: say(f"page on {page_url(listening)}\n", stdout),
        )
    return 0


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {VIEW}",
        description="Serves a web page that shows a robot as it moves. With its backdoor one can push it "
        "there, stop it, and break its replies.",
        examples={
            "127.0.0.1:30001": "the robot of that status port, to look at and to stop",
            "127.0.0.1:30001 --backdoor 127.0.0.1:30002": "the same, with all that a test bench can do",
        },
    )
    add_server(parser)
    parser.add_argument(
        "--backdoor",
        type=server_address,
        metavar="HOST:PORT",
        help="where the robot's backdoor listens (default: the page only shows the robot, and stops it)",
    )
    parser.add_argument(
        "--backdoor-token-file",
        type=secret_in,
        metavar="FILE",
        help="the token of the backdoor is in this file (default: it asks for none)",
    )
    parser.add_argument(
        "--driver",
        type=server_address,
        metavar="HOST:PORT",
        help="where the robot speaks the iiwa's text protocol, to type commands on the page (default: none)",
    )
    add_robot(parser)
    add_page(parser)
    add_log(parser)
    return parser
