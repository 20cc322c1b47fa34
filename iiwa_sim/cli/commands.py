"""The commands beside the simulator: each takes its parser and its words, and returns the exit code.

Its docstring stands in its --help. It imports what it needs when it runs: others may need an extra.
"""

import asyncio
import logging
import signal
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from iiwa_sim import log
from iiwa_sim.cli.parsing import Parser, from_command_line, reached_at, server
from iiwa_sim.options.model import SettingError, Settings
from iiwa_sim.wording import Unusable, harmless, need_library, shortened

if TYPE_CHECKING:
    from iiwa_sim.recordings.read import Recording

PICTURES = (".png", ".svg")
PROGRAMS = ("iiwa-sim", "iiwa_sim")
"""Names of the script, and of the module behind `python -m`."""
HEALTH_S = 2.0
"""Seconds for each protocol: a check of two protocols ends before Docker's limit of 5 s."""


def plot(parser: Parser, words: Sequence[str]) -> int:
    """The file has one command per line, also 'wait SECONDS' and 'wait stopped'; a # begins a comment.

    iiwa-sim plot examples/blending.txt -o blending.svg
    iiwa-sim plot examples/probing.txt --cell examples/table.toml -o probing.svg
    iiwa-sim plot run.mcap -o run.png
    """
    parser.add_argument("commands", type=Path, metavar="COMMANDS|FILE.mcap", help="commands or a recording")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="PICTURE", help=".png or .svg")
    parser.add_argument("--cell", metavar="CELL.toml", help="robot, start pose, tool, surfaces and parts")
    parser.add_options(("robot", "rate_hz"))
    own, given = parser.parsed(words)
    settings = Settings(**given)
    suffix = own.output.suffix.lower()
    if suffix not in PICTURES:
        raise SettingError(f"-o/--output: {own.output} does not end in {' or '.join(PICTURES)}")
    is_recorded = own.commands.suffix.lower().partition(":")[0] == ".mcap"
    with suppress(OSError):
        if own.commands.is_file():  # a pipe is read only once
            with own.commands.open("rb") as file:
                is_recorded |= file.read(8) == b"\x89MCAP0\r\n"
    if is_recorded and given:
        raise SettingError("--cell, --robot, --rate: expected none with a recording, which names its own")
    need_library("mcap", "record")
    need_library("matplotlib", "plot")
    from iiwa_sim.cell.cell import cells_of
    from iiwa_sim.plot.draw import picture
    from iiwa_sim.plot.motion import motion_in, run
    from iiwa_sim.recordings.read import Recording

    if is_recorded:
        recorded = Recording(own.commands)
        motion = motion_in(recorded)
        _warn_if_cut(recorded)
    else:
        cell, *others = cells_of(settings.robot, settings.cell)
        if others:
            raise SettingError(f"--cell {settings.cell}: expected a cell with one robot")
        logging.getLogger("iiwa_sim").addHandler(logging.NullHandler())  # the message has rejected commands
        motion = run(own.commands, cell, settings.rate_hz)
    try:
        title = f"{harmless(own.commands.name)} on {harmless(motion.description.name)}"
        own.output.write_bytes(picture(motion, shortened(title, 100), suffix[1:]))
    except OSError as fault:
        raise Unusable(f"{own.output}: cannot be written: {fault.strerror}") from None
    return 0


def check_cell(parser: Parser, words: Sequence[str]) -> int:
    """iiwa-sim check-cell examples/table.toml"""
    parser.add_argument("file", metavar="CELL.toml")
    own, _ = parser.parsed(words)
    from iiwa_sim.cell.cell import load_cells, summary
    from iiwa_sim.protocols.protocols import fitting_protocols
    from iiwa_sim.simulator import Simulator

    cells = load_cells(own.file)
    for cell in cells:
        Simulator(cell=cell, protocol=None if cell.ports else fitting_protocols(cell.description))
    print(summary(cells), end="")
    return 0


def replay(parser: Parser, words: Sequence[str]) -> int:
    """Exit code 0 if all replies agree, 1 if some deviate, 2 if the file cannot be played.

    iiwa-sim replay session.txt 127.0.0.1:30000
    """
    parser.add_argument("file", type=Path, metavar="FILE", help="a file of --transcript")
    parser.add_argument("server", type=server, metavar="HOST:PORT[,PORT]", help="a port for each protocol")
    own, _ = parser.parsed(words)
    from iiwa_sim.transcript.lines import read_file
    from iiwa_sim.transcript.replay import replay as played

    transcript = read_file(own.file)
    deviations = 0
    for deviation in played(transcript, *own.server):
        deviations += 1
        print(harmless(f"{transcript.name}:{deviation.line}: {deviation}"), flush=True)
    print(f"{deviations} deviation{'' if deviations == 1 else 's'} in {len(transcript.steps)} lines")
    return 1 if deviations else 0


def check(parser: Parser, words: Sequence[str]) -> int:
    """It sends commands that move nothing: hello, help, stop, bye, get ..., is ..., and unknown ones.

    Exit code 0 if nothing deviates, 1 if something does, 2 without a server or if the robot moves.

      iiwa-sim check 172.31.1.147:30000
    """
    motion = (
        "also send moves, from where the robot is and back: up to 40 mm upwards, 0.1 rad of A7, 0.03 rad "
        "of A3 with the TCP held, at up to a fifth of the speed"
    )
    parser.add_argument("server", type=partial(server, most=1), metavar="HOST:PORT", help="where it listens")
    parser.add_argument("--allow-motion", action="store_true", default=False, help=motion)
    own, _ = parser.parsed(words)
    from iiwa_sim.check import check as report
    from iiwa_sim.check.probes import Finding, Link, Verdict

    host, (port,) = own.server
    link = Link(host, port, own.allow_motion)
    findings: list[Finding] = []
    for probe, finding in report.check(link):
        if not findings:
            print(report.HEAD)
        findings.append(finding)
        print(report.line(probe, finding), flush=True)
    print(report.summary(findings))
    return 1 if any(finding.verdict is Verdict.DEVIATION for finding in findings) else 0


def show(parser: Parser, words: Sequence[str]) -> int:
    """It needs the extras record and view. Exit code 0 after SIGTERM or SIGINT.

    iiwa-sim show run.mcap
    """
    parser.add_argument("recording", type=Path, metavar="FILE.mcap", help="a recording of --record")
    text = "port of the page (default: 8080)"
    parser.add_argument("--port", dest="page_port", type=int, default=8080, metavar="PORT", help=text)
    own, _ = parser.parsed(words)
    need_library("mcap", "record")
    from iiwa_sim.cli.serve import listen, page_url
    from iiwa_sim.recordings.read import Timeline
    from iiwa_sim.server.token import LOOPBACK

    timeline = Timeline(own.recording)
    _warn_if_cut(timeline.recorded)
    with asyncio.run(listen(LOOPBACK, own.page_port)) as listening:
        from iiwa_sim.view.playback import run_playback

        over = threading.Event()
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: over.set())
        log.configure("warning", as_json=False)
        print(f"page on {page_url(listening)}", flush=True)
        run_playback(listening, timeline, over)
    return 0


def health(parser: Parser, words: Sequence[str]) -> int:
    """It asks all protocols of a process; with --count and --fleet those of the first robot.

    Exit code 0 if all answer, else 1.

      iiwa-sim health
    """
    number = "number of the process (default: 1, the first of a container)"
    parser.add_argument("process", nargs="?", type=int, default=1, metavar="PROCESS", help=number)
    process = parser.parsed(words)[0].process
    from iiwa_sim.client import Iiwa, Krc4, ReplyError
    from iiwa_sim.options.sources import from_environment, merged, robots_in, robots_of
    from iiwa_sim.protocols.ports import IIWA

    what = f"process {process}"
    try:
        line, environment = (
            Path(f"/proc/{process}/{each}").read_text(errors="surrogateescape").split("\0")[:-1]
            for each in ("cmdline", "environ")
        )
        own = next((i for i, word in enumerate(line, 1) if Path(word).name in PROGRAMS), len(line))
        variables, _ = from_environment(dict(each.partition("=")[::2] for each in environment))
        name, settings = next(iter(robots_of(merged(variables, from_command_line(line[own:]))).items()))
        for robot, ports in (robots_in(settings) or {"": settings.ports}).items():
            for protocol, port in ports.items():
                what = f"{name} {robot} {protocol} on port {port}"
                address = reached_at(settings.host), port, HEALTH_S
                if protocol == IIWA:
                    with Iiwa(*address) as iiwa:
                        iiwa.hello()
                else:
                    with Krc4(*address) as krc4:
                        krc4.fin()
    except (OSError, ReplyError) as fault:
        print(f"iiwa-sim: {' '.join(what.split())}: {fault}", file=sys.stderr)
        return 1
    return 0


def ros2_env(parser: Parser, words: Sequence[str]) -> int:
    """It prints the interpreter, which iiwa-sim --ros2 finds in the default folder (x86-64 Linux, 270 MB).

    Types without a wheel (control_msgs, tf2_msgs, robot_movement_interface) need g++ and python3-dev.

      iiwa-sim ros2-env
    """
    folder = "folder to make it in (default: iiwa-sim/ros2 in $XDG_CACHE_HOME, or in ~/.cache)"
    parser.add_argument("folder", nargs="?", default="", metavar="FOLDER", help=folder)
    own, _ = parser.parsed(words)
    from iiwa_sim.ros.ros2_env import default_folder, make

    print(make(Path(own.folder) if own.folder else default_folder()))
    return 0


def _warn_if_cut(recorded: "Recording") -> None:
    if recorded.cut_at_s is not None:
        where = f"cut off or damaged at {round(recorded.cut_at_s, 3):g} s: what follows is lost"
        print(harmless(f"iiwa-sim: {recorded.path}: {where}"), file=sys.stderr)
