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
from iiwa_sim.plot.fault import PlotFault
from iiwa_sim.robot.description import DEFAULT_ROBOT
from iiwa_sim.wording import shortened

if TYPE_CHECKING:
    from iiwa_sim.plot.record import Recording

PICTURES = (".png", ".svg")
FILMS = (".gif", ".mp4", ".html")


def run(given: Sequence[str]) -> int:
    options = _options(given)
    try:
        from iiwa_sim.plot.draw import picture
    except ModuleNotFoundError as fault:
        if not (fault.name or "").startswith("matplotlib"):
            raise
        raise PlotFault("a picture needs matplotlib: pip install 'iiwa-sim[plot]'") from None
    commands = Path(options.commands)
    recording = _recorded(commands) if is_recording(commands) else _run(options)
    if options.output is not None:
        _write(options.output, picture(recording, _format(options.output)))
    if options.animate is not None:
        from iiwa_sim.plot.film import film

        _write(options.animate, film(recording, _format(options.animate)))
    return 0


def _format(path: Path) -> str:
    return path.suffix[1:].lower()


def _write(path: Path, data: bytes) -> None:
    try:
        path.write_bytes(data)
    except OSError as fault:
        raise PlotFault(f"{path}: cannot be written: {fault.strerror}") from None


def _run(options: argparse.Namespace) -> "Recording":
    from iiwa_sim.cell.cell import load_cell, robot_alone
    from iiwa_sim.plot.record import record
    from iiwa_sim.plot.script import read_script

    if options.cell is None:
        cell = robot_alone(DEFAULT_ROBOT if options.robot is None else options.robot)
    else:
        cell = load_cell(options.cell)
    rate_hz = DEFAULT_RATE_HZ if options.rate is None else options.rate
    return record(read_script(options.commands), cell, rate_hz)


def _recorded(path: Path) -> "Recording":
    recorded = opened(path)
    from iiwa_sim.plot.recorded import drawn_from

    recording = drawn_from(recorded)
    tell_cut(recorded)
    return recording


def _options(given: Sequence[str]) -> argparse.Namespace:
    parser = _parser()
    options = parser.parse_args(given)
    check_robot(parser.error, options)
    if options.output is None and options.animate is None:
        parser.error("expected -o PICTURE, --animate FILM, or both")
    if is_recording(Path(options.commands)):
        for name in ("cell", "robot", "rate"):
            if getattr(options, name) is not None:
                parser.error(f"argument --{name}: expected none with a recording, which names its own")
    return options


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {PLOT}",
        description="Runs a file of commands in simulated time and draws the motion: positions, velocities "
        "and accelerations of the joints, speed and way of the TCP, with targets and blending spheres, the "
        "arm in its cell, and the forces at the TCP with the thresholds of force moves, where there are any.",
        epilog="In the file: one command per line as on the wire, besides 'wait SECONDS' and 'wait stopped'; "
        "what follows a # is a comment. Below the line 'dialect krc4' they are KRC4 messages, as Cmd I1=100.",
        examples={
            "examples/blending.txt -o blending.svg": "a chain of moves that blend",
            "examples/probing.txt --cell examples/table.toml -o probing.svg": "moves that feel for a table",
            "run.mcap -o run.png --animate run.gif": "what was recorded with --record, also as a film",
        },
    )
    parser.add_argument(
        "commands", metavar="COMMANDS|FILE.mcap", help="file of commands, or a recording of --record"
    )
    parser.add_argument(
        "-o", "--output", type=_picture, metavar="PICTURE", help="file to write, .png or .svg"
    )
    parser.add_argument(
        "--animate",
        type=_film,
        metavar="FILM",
        help="a film of the arm: .gif, .html, or .mp4 by the program ffmpeg",
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
    return _ending_in(PICTURES, text)


def _film(text: str) -> Path:
    return _ending_in(FILMS, text)


def _ending_in(known: Sequence[str], text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in known:
        *others, last = known
        shown = shortened(repr(text), 40)
        raise argparse.ArgumentTypeError(f"{shown} does not end in {', '.join(others)} or {last}")
    return path
