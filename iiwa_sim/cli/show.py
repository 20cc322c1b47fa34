"""`iiwa-sim show`: plays a recording on a web page, with a time line."""

from collections.abc import Sequence

from iiwa_sim.cli.names import SHOW
from iiwa_sim.cli.options import add_log
from iiwa_sim.cli.page import add_page, served
from iiwa_sim.cli.parsing import Parser, path
from iiwa_sim.cli.reach import check_token
from iiwa_sim.cli.recordings import opened, tell_cut


def run(given: Sequence[str]) -> int:
    parser = _parser()
    options = parser.parse_args(given)
    token = check_token(parser.error, options, "", "page")
    opened(options.recording)  # whether it is one, before the page is loaded
    with served(options) as page:
        from iiwa_sim.recordings.timeline import Timeline
        from iiwa_sim.view.playback import run_playback

        timeline = Timeline(options.recording)
        tell_cut(timeline)
        run_playback(page.listening, timeline, page.over, token, page.announce)
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
