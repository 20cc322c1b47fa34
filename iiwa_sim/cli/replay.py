"""`iiwa-sim replay`: plays a transcript against a server."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from iiwa_sim.cli.names import REPLAY
from iiwa_sim.cli.options import add_servers
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser, path
from iiwa_sim.cli.recordings import is_recording, opened, tell_cut
from iiwa_sim.wording import harmless

if TYPE_CHECKING:
    from iiwa_sim.transcript.lines import Transcript


def run(given: Sequence[str]) -> int:
    options = _parser().parse_args(given)
    from iiwa_sim.transcript.replay import replay

    transcript = _transcript(options.transcript)
    deviations = 0
    for deviation in replay(transcript, *options.server):
        deviations += 1
        say(harmless(f"{transcript.name}:{deviation.line}: {deviation}") + "\n")
    say(f"{deviations} deviation{'' if deviations == 1 else 's'} in {len(transcript.steps)} lines\n")
    return 1 if deviations else 0


def _transcript(path: Path) -> "Transcript":
    if not is_recording(path):
        from iiwa_sim.transcript.lines import read_file

        return read_file(path)
    recorded = opened(path)
    from iiwa_sim.recordings.dialogue import transcript_of

    transcript = transcript_of(recorded)
    tell_cut(recorded)
    return transcript


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {REPLAY}",
        description="Plays a transcript, or the dialogue of a recording FILE.mcap, against a server and "
        "reports each reply that differs.",
        epilog="Exit code 0 if all replies agree, 1 if some deviate, 2 if the file cannot be played.",
        examples={
            "session.txt 127.0.0.1:30000": "the dialogue that --transcript has recorded",
            "run.mcap 127.0.0.1:30000": "the dialogue of a recording of --record",
        },
    )
    parser.add_argument(
        "transcript",
        type=path,
        metavar="FILE",
        help="a transcript of --transcript, or a recording of --record",
    )
    add_servers(parser)
    return parser
