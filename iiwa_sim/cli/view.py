"""`iiwa-sim view`: the live page of robots that run elsewhere."""

import asyncio
import signal
import sys
import threading
from collections.abc import Sequence
from itertools import zip_longest

from iiwa_sim import log
from iiwa_sim.cli.names import VIEW
from iiwa_sim.cli.options import add_log, add_robot, secret_in, server_address
from iiwa_sim.cli.output import say
from iiwa_sim.cli.page import add_page, check_library, page_token, page_url
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.serve.listening import host_and_port, open_listener


def run(given: Sequence[str]) -> int:
    parser = _parser()
    options = parser.parse_args(given)
    token = page_token(parser, options)
    for option in OF_EACH:
        given_so_often = len(getattr(options, option))
        if given_so_often not in (0, len(options.servers)):
            parser.error(f"argument --{option}: {given_so_often} given, expected one for each HOST:PORT")
    check_library()
    log.configure(options.log_level, options.log_json, sys.stderr.fileno())
    over = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: over.set())
    with asyncio.run(open_listener(options.host, options.port)) as listening:
        from iiwa_sim.view.live import run_page
        from iiwa_sim.view.station import Place

        of_each = zip_longest(options.servers, *(getattr(options, option) for option in OF_EACH))
        places = [
            Place(
                name=name or host_and_port(*status),
                status=status,
                backdoor=backdoor,
                token=options.backdoor_token_file or "",
                driver=driver,
                robot=options.robot,
            )
            for status, backdoor, driver, name in of_each
        ]
        stdout = sys.stdout  # viser's own words go nowhere
        run_page(
            listening,
            places,
            over,
            token,
            lambda: say(f"page on {page_url(listening)}\n", stdout),
        )
    return 0


OF_EACH = ("backdoor", "driver", "name")
"""Options that are given once for each robot, in the order of their addresses, or not at all."""


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {VIEW}",
        description="Serves a web page that shows robots as they move. With a backdoor the page can also "
        "push them, stop them, and inject faults.",
        examples={
            "127.0.0.1:30001": "the robot of that status port, to look at and to stop",
            "127.0.0.1:30001 --backdoor 127.0.0.1:30002": "the same, with all that a test bench can do",
            "10.0.0.5:30001 10.0.0.6:30001": "two robots; a click on one brings its panel",
        },
    )
    parser.add_argument(
        "servers",
        type=server_address,
        nargs="+",
        metavar="HOST:PORT",
        help="status port of a robot; with several the page shows all robots",
    )
    parser.add_argument(
        "--backdoor",
        type=server_address,
        action="append",
        default=[],
        metavar="HOST:PORT",
        help="backdoor of the robot; with several robots once for each, in their order, as --driver "
        "and --name (default: the page only shows the robot, and stops it)",
    )
    parser.add_argument(
        "--backdoor-token-file",
        type=secret_in,
        metavar="FILE",
        help="file with the token of the backdoor, or of all backdoors (default: they need none)",
    )
    parser.add_argument(
        "--driver",
        type=server_address,
        action="append",
        default=[],
        metavar="HOST:PORT",
        help="where the robot speaks the iiwa's text protocol, to type commands on the page (default: none)",
    )
    parser.add_argument(
        "--name",
        action="append",
        default=[],
        help="name of the robot on the page (default: its HOST:PORT)",
    )
    add_robot(parser)
    add_page(parser)
    add_log(parser)
    return parser
