"""`iiwa-sim check`: reports how a server deviates from the original controller."""

from collections.abc import Sequence

from iiwa_sim.cli.names import CHECK
from iiwa_sim.cli.options import add_server
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser


def run(given: Sequence[str]) -> int:
    options = _parser().parse_args(given)
    from iiwa_sim.check import report
    from iiwa_sim.check.check import check
    from iiwa_sim.check.findings import Finding, Verdict
    from iiwa_sim.check.link import Link

    host, port = options.server
    link = Link(host, port, options.allow_motion)
    findings: list[Finding] = []
    for probe, finding in check(link):
        if not findings:
            say(f"{report.HEAD}\n")
        findings.append(finding)
        say(report.line(probe, finding) + "\n")
    say(report.summary(findings, link.sent) + "\n")
    return 1 if any(finding.verdict is Verdict.DEVIATION for finding in findings) else 0


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {CHECK}",
        description="Reports where a server deviates from the original one of this protocol. Sends hello, "
        "help, stop, bye, lines that are no commands, and commands that begin with get or is, which move "
        "nothing. The robot has to be at rest.",
        epilog="Exit code 0 if nothing deviates, 1 if something does, 2 without a server, or with a robot "
        "that moves.",
        examples={"172.31.1.147:30000": "asks a robot, and moves nothing"},
    )
    add_server(parser)
    parser.add_argument(
        "--allow-motion",
        action="store_true",
        help="also send moves, from where the robot is and back: up to 40 mm upwards, 0.1 rad of A7, 0.03 "
        "rad of A3 with the TCP held, at up to a fifth of the speed",
    )
    return parser
