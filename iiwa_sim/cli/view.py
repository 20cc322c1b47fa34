"""`iiwa-sim view`: the live page of robots that run elsewhere."""

from collections.abc import Sequence
from itertools import zip_longest

from iiwa_sim.cli.names import VIEW
from iiwa_sim.cli.options import add_log, add_robot, server_address
from iiwa_sim.cli.page import add_page, served
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.cli.reach import check_token, secret_in
from iiwa_sim.serve.listening import host_and_port


def run(given: Sequence[str]) -> int:
    parser = _parser()
    options = parser.parse_args(given)
    token = check_token(parser.error, options, "", "page")
    for option in OF_EACH:
        given_so_often = len(getattr(options, option))
        if given_so_often not in (0, len(options.servers)):
            parser.error(f"argument --{option}: {given_so_often} given, expected one for each HOST:PORT")
    with served(options) as page:
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
        run_page(page.listening, places, page.over, token, page.announce)
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
