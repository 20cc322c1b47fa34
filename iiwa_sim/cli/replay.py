"""`iiwa-sim replay`: plays a transcript against a server."""

from collections.abc import Sequence
from pathlib import Path

from iiwa_sim.cli.names import REPLAY
from iiwa_sim.cli.options import add_servers
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.wording import harmless


def run(given: Sequence[str]) -> int:
    options = _parser().parse_args(given)
    from iiwa_sim.transcript.lines import read_file
    from iiwa_sim.transcript.replay import replay

    transcript = read_file(options.transcript)
    deviations = 0
    for deviation in replay(transcript, *options.server):
        deviations += 1
        say(harmless(f"{transcript.name}:{deviation.line}: {deviation}") + "\n")
    say(f"{deviations} deviation{'' if deviations == 1 else 's'} in {len(transcript.steps)} lines\n")
    return 1 if deviations else 0


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {REPLAY}",
        description="Plays a transcript against a server and tells which lines are answered otherwise.",
        epilog="Exit code 0 if there are none, 1 if there are some, 2 if it cannot be played.",
        examples={"session.txt 127.0.0.1:30000": "what was recorded with --transcript, said again"},
    )
    parser.add_argument("transcript", type=Path, metavar="FILE", help="as --transcript records it")
    add_servers(parser)
    return parser
