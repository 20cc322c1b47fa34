"""`iiwa-sim plot`: a picture of a motion."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from iiwa_sim.cli.names import PLOT
from iiwa_sim.cli.options import add_rate, add_robot, check_robot
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.cli.recordings import is_recording, opened, tell_cut
from iiwa_sim.clock.clock import DEFAULT_RATE_HZ
from iiwa_sim.plot.script import PlotFault, read_script
from iiwa_sim.wording import shortened

if TYPE_CHECKING:
    from iiwa_sim.plot.motion import Motion

PICTURES = (".png", ".svg")


def run(given: Sequence[str]) -> int:
    options = _options(given)
    try:
        from iiwa_sim.plot.draw import picture
    except ModuleNotFoundError as fault:
        if not (fault.name or "").startswith("matplotlib"):
            raise
        raise PlotFault("a picture needs matplotlib: pip install 'iiwa-sim[plot]'") from None
    commands, output = Path(options.commands), options.output
    motion = _recorded(commands) if is_recording(commands) else _run(options)
    data = picture(motion, output.suffix[1:].lower())
    try:
        output.write_bytes(data)
    except OSError as fault:
        raise PlotFault(f"{output}: cannot be written: {fault.strerror}") from None
    return 0


def _run(options: argparse.Namespace) -> "Motion":
    from iiwa_sim.cell.cell import cell_of
    from iiwa_sim.plot.run import run

    cell = cell_of(options.robot, options.cell)
    return run(read_script(options.commands), cell, options.rate or DEFAULT_RATE_HZ)


def _recorded(path: Path) -> "Motion":
    recorded = opened(path)
    from iiwa_sim.plot.recorded import motion_in

    motion = motion_in(recorded)
    tell_cut(recorded)
    return motion


def _options(given: Sequence[str]) -> argparse.Namespace:
    parser = _parser()
    options = parser.parse_args(given)
    check_robot(parser.error, options)
    if is_recording(Path(options.commands)):
        for name in ("cell", "robot", "rate"):
            if getattr(options, name) is not None:
                parser.error(f"argument --{name}: expected none with a recording, which names its own")
    return options


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {PLOT}",
        description="Runs a file of commands in simulated time and draws the motion: joints, TCP and forces "
        "over time, and the path of the TCP with the targets of moves and their blending radii.",
        epilog="In the file: one command per line as on the wire, besides 'wait SECONDS' and 'wait stopped'; "
        "what follows a # is a comment. Below the line 'dialect krc4' they are KRC4 messages, as Cmd I1=100.",
        examples={
            "examples/blending.txt -o blending.svg": "a chain of moves that blend",
            "examples/probing.txt --cell examples/table.toml -o probing.svg": "moves that feel for a table",
            "run.mcap -o run.png": "what was recorded with --record",
        },
    )
    parser.add_argument(
        "commands", metavar="COMMANDS|FILE.mcap", help="file of commands, or a recording of --record"
    )
    parser.add_argument(
        "-o", "--output", type=_picture, required=True, metavar="PICTURE", help="file to write, .png or .svg"
    )
    parser.add_argument(
        "--cell",
        metavar="CELL.toml",
        help="robot, start pose, tool, surfaces and parts (default: a robot alone)",
    )
    add_robot(parser)
    add_rate(parser, default=None)
    return parser


def _picture(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in PICTURES:
        shown = shortened(repr(text), 40)
        raise argparse.ArgumentTypeError(f"{shown} does not end in {' or '.join(PICTURES)}")
    return path
