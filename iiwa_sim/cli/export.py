"""`iiwa-sim export`: writes a recording as tables."""

from collections.abc import Sequence

from iiwa_sim.cli.names import EXPORT
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser, path
from iiwa_sim.cli.recordings import opened, tell_cut
from iiwa_sim.wording import harmless


def run(given: Sequence[str]) -> int:
    options = _parser().parse_args(given)
    recorded = opened(options.recording)
    from iiwa_sim.recordings.tables import write_tables

    folder = options.recording.parent if options.output is None else options.output
    for file in write_tables(recorded, folder):
        say(harmless(str(file)) + "\n")
    tell_cut(recorded)
    return 0


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {EXPORT}",
        description="Writes a recording as tables: its states, its dialogue and its events, in a file each, "
        "FILE.state.csv and so on. Columns of states carry their units.",
        examples={"run.mcap --csv": "its states, dialogue and events beside it"},
    )
    parser.add_argument("recording", type=path, metavar="FILE.mcap", help="a recording of --record")
    parser.add_argument("--csv", action="store_true", required=True, help="as CSV, in UTF-8")
    parser.add_argument(
        "-o",
        "--output",
        type=path,
        metavar="FOLDER",
        help="folder to write into (default: that of the recording)",
    )
    return parser
