"""The fixture `iiwa`: a robot of its own for every test, in a thread of the test's process.

Nothing of the simulator is imported before a test asks for the fixture. Options come from the marker
`iiwa`, where there is none from the command line, then from the ini file.
"""

import hashlib
import importlib.util
import os
import re
import shlex
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

if TYPE_CHECKING:
    from iiwa_sim.controller.snapshot import Snapshot
    from iiwa_sim.recording import Recording
    from iiwa_sim.simulator import Simulator

DEFAULT_CLOCK = "fast"
"""A driver's tests wait for motion most of their time, and few of them ask how long it takes."""

ARTIFACT_RATE_HZ = 100
"""States in a simulated second of a recording that is made in case the test fails: in haste each costs more
than a tick. `iiwa.record(FILE)` and the marker's `record` keep every tick."""
OPEN_WITH = (
    "to look at it: iiwa-sim plot {path} -o picture.png, or open the file in Foxglove, Lichtblick or "
    "PlotJuggler; the dialogue and events as tables: iiwa-sim export {path} --csv"
)
LONGEST_FILE_NAME = 120

REPORT_S = 10.0
"""So long a report waits for the robot's thread, which a test may block."""


class _Option(NamedTuple):
    kind: type | tuple[type, ...]
    expected: str


_PATH = _Option((str, os.PathLike), "a name or a path")
_FILE = _Option((str, os.PathLike), "the path of a file")
_SECONDS = _Option((int, float), "a number of seconds")
_PORT = _Option(int, "a port")
_OPTIONS = {
    "robot": _PATH,
    "cell": _PATH,
    "dialects": _Option((list, tuple), "a list, of iiwa or krc4 or both"),
    "clock": _Option(str, "real, 10x, fast or stepped"),
    "rate_hz": _Option(int, "a whole number"),
    "servo_timeout_s": _SECONDS,
    "port": _PORT,
    "status_port": _PORT,
    "status_rate_hz": _Option(int, "a whole number"),
    "strict": _Option(bool, "True or False"),
    "exclusive": _Option(bool, "True or False"),
    "reconnect_pause_s": _SECONDS,
    "transcript": _FILE,
    "record": _FILE,
    "record_rate_hz": _Option(int, "a whole number"),
}
_INI = {
    "robot": "name or folder of the robot",
    "cell": "path of a cell.toml, which names its robot",
    "dialect": "what is spoken: iiwa (default), krc4, or both with a comma between",
    "clock": f"how simulated time passes: real, 10x, fast or stepped (default: {DEFAULT_CLOCK})",
    "rate": "ticks per second, 100 to 1000",
    "strict": "whether more values than a command takes are an error: true or false (default: false)",
}
_NAMES = {"rate": "rate_hz", "dialect": "dialects"}


class _Watched(NamedTuple):
    """What a report shows of a robot."""

    dialogue: Callable[[], str]
    state: "Callable[[], Snapshot]"


_WATCHED = pytest.StashKey[_Watched]()
_ARTIFACT = pytest.StashKey[Path]()
_FAILED = pytest.StashKey[bool]()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("iiwa-sim", "the simulated robot of the fixture iiwa")
    for name, says in _INI.items():
        group.addoption(f"--iiwa-{name}", metavar=name.upper(), help=says)
        parser.addini(f"iiwa_{name}", says)
    group.addoption(
        "--iiwa-artifacts",
        metavar="DIR",
        help="keep recordings of the robots of failed tests there, one file for each, as .mcap",
    )
    group.addoption("--iiwa-artifacts-all", action="store_true", help="also of tests that pass")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", f"iiwa({', '.join(f'{name}=...' for name in _OPTIONS)}): options of the fixture iiwa"
    )
    folder = config.getoption("--iiwa-artifacts")
    if folder is not None:
        _check_artifacts(config.invocation_params.dir / folder)
    elif config.getoption("--iiwa-artifacts-all"):
        raise pytest.UsageError("--iiwa-artifacts-all: expected --iiwa-artifacts DIR with it")


@pytest.fixture
def iiwa(request: pytest.FixtureRequest) -> "Iterator[Simulator]":
    """A simulated robot that listens on `iiwa.host`, `iiwa.port`, at rest at home.

    It has the methods of `iiwa_sim.simulator.Simulator`. What the marker `iiwa` gives is handed on to it.
    """
    simulator, recording = _started(_options(request))
    stash = request.node.stash
    folder = request.config.getoption("--iiwa-artifacts")
    try:
        if folder is not None:
            path = request.config.invocation_params.dir / folder / _file_name(request.node.nodeid)
            _record(simulator, path)
            stash[_ARTIFACT] = path
        stash[_WATCHED] = _Watched(
            lambda: simulator.call(recording.text, REPORT_S),
            lambda: simulator.call(simulator.state, REPORT_S),
        )
        yield simulator
    finally:
        try:
            simulator.__exit__(None, None, None)
        except TimeoutError as blocked:
            stash[_WATCHED] = _Watched(recording.text, simulator.state)
            raise _fault(f"the robot could not be ended: {blocked}") from None
        end = simulator.state()
        stash[_WATCHED] = _Watched(recording.text, lambda: end)  # pytest keeps it: the robot need not stay


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    outcome: Any = yield  # pluggy's own type has no public name in older releases
    watched = item.stash.get(_WATCHED, None)
    if watched is None:
        return
    report = outcome.get_result()
    if report.failed:
        from iiwa_sim.recording import told

        try:
            report.sections.append(("iiwa dialogue", watched.dialogue()))
            report.sections.append(("iiwa state", told(watched.state())))
        except TimeoutError as blocked:
            report.sections.append(("iiwa", f"nothing can be told: {blocked}"))
        item.stash[_FAILED] = True
        path = item.stash.get(_ARTIFACT, None)
        if path is not None:
            how = OPEN_WITH.format(path=shlex.quote(str(path)))
            report.sections.append(("iiwa recording", f"{path}\n{how}"))
    if call.when == "teardown":
        del item.stash[_WATCHED]
        _sweep(item)


def _check_artifacts(folder: Path) -> None:
    if importlib.util.find_spec("mcap") is None:
        raise pytest.UsageError("--iiwa-artifacts: needs the library mcap: pip install 'iiwa-sim[record]'")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        told = f"--iiwa-artifacts: {folder}: no folder can be there: {fault.strerror}"
        raise pytest.UsageError(told) from None


def _file_name(nodeid: str) -> str:
    """A name that no other test has, for people to read."""
    text = re.sub(r"[^\w.-]+", "_", nodeid, flags=re.ASCII).strip("_")
    if len(text) > LONGEST_FILE_NAME or text != nodeid.replace("::", "_").replace("/", "_"):
        text = f"{text[:LONGEST_FILE_NAME]}_{hashlib.sha256(nodeid.encode()).hexdigest()[:8]}"
    return f"{text}.mcap"


def _record(simulator: "Simulator", path: Path) -> None:
    from iiwa_sim.recordings.fault import RecordingFault

    try:
        simulator.record(path, min(ARTIFACT_RATE_HZ, simulator.clock.rate_hz))
    except RecordingFault as fault:
        raise _fault(str(fault)) from None


def _sweep(item: pytest.Item) -> None:
    """Keep no recording of a test that has passed."""
    path = item.stash.get(_ARTIFACT, None)
    keeps = item.config.getoption("--iiwa-artifacts-all") or item.stash.get(_FAILED, False)
    if path is not None and not keeps:
        with suppress(OSError):
            path.unlink()


def _started(options: dict[str, Any]) -> "tuple[Simulator, Recording]":
    from iiwa_sim.recording import Recording
    from iiwa_sim.recordings.fault import RecordingFault
    from iiwa_sim.serve.listening import ListenFault
    from iiwa_sim.settings import SettingsFault
    from iiwa_sim.simulator import Simulator
    from iiwa_sim.transcript.fault import TranscriptFault

    start_ns = time.monotonic_ns()
    try:
        simulator = Simulator(**options)
        recording = Recording(simulator.clock.tick_s, start_ns)
        simulator.dialogue.listeners.append(recording)
        return simulator.__enter__(), recording
    except (ValueError, SettingsFault, ListenFault, TranscriptFault, RecordingFault) as fault:
        raise _fault(str(fault)) from None


def _options(request: pytest.FixtureRequest) -> dict[str, Any]:
    """What is handed on to `Simulator`; the nearest says what holds. Fails the test for a wrong marker."""
    config = request.config
    ini_folder = config.inipath.parent if config.inipath is not None else config.rootpath
    options: dict[str, Any] = {"clock": DEFAULT_CLOCK, "backdoor_port": 0}
    _take(options, {name: config.getini(f"iiwa_{name}") or None for name in _INI}, ini_folder)
    _take(options, {name: config.getoption(f"iiwa_{name}") for name in _INI}, config.invocation_params.dir)
    markers = list(request.node.iter_markers("iiwa"))
    for marker in reversed(markers):  # those of the function last
        if marker.args:
            raise _fault(f"{marker.args[0]!r}: expected NAME=VALUE")
        for name, value in marker.kwargs.items():
            if name not in _OPTIONS:
                raise _fault(f"{name}: expected one of {', '.join(_OPTIONS)}")
            kind = _OPTIONS[name].kind
            if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
                raise _fault(f"{name}={value!r}: expected {_OPTIONS[name].expected}")
        _take(options, marker.kwargs, request.path.parent)
    return options


def _take(options: dict[str, Any], given: dict[str, Any], folder: Path) -> None:
    """Put what is given into the options; paths start at the folder."""
    given = {_NAMES.get(name, name): value for name, value in given.items() if value is not None}
    if "robot" in given or "cell" in given:  # a cell names its robot: one stands for the other
        options.pop("robot", None)
        options.pop("cell", None)
    if "cell" in given:
        given["cell"] = folder / given["cell"]
    if "robot" in given:
        with suppress(OSError):  # no name of a folder, to be told by who loads it
            if (folder / given["robot"]).is_dir():
                given["robot"] = folder / given["robot"]
    for name in ("transcript", "record"):
        if name in given:
            given[name] = folder / given[name]
    if isinstance(given.get("dialects"), str):
        given["dialects"] = [name.strip() for name in given["dialects"].split(",")]
    if isinstance(given.get("strict"), str):
        if given["strict"] not in ("true", "false"):
            raise _fault(f"strict {given['strict']!r}: expected true or false")
        given["strict"] = given["strict"] == "true"
    if isinstance(given.get("rate_hz"), str):
        if not given["rate_hz"].isdigit():
            raise _fault(f"rate {given['rate_hz']!r}: expected a whole number")
        given["rate_hz"] = int(given["rate_hz"])
    options.update(given)


def _fault(why: str) -> BaseException:
    """A failure that the report shows in one line."""
    return pytest.fail.Exception(f"fixture iiwa: {why}", pytrace=False)
