"""The fixtures `iiwa`, `iiwa_factory` and `iiwa_session`: robots in threads of the tests' process.

Nothing of the simulator is imported before a test asks for a fixture. Options come from the marker `iiwa`,
where there is none from the command line, then from the ini file.
"""

import hashlib
import importlib.util
import re
import shlex
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

from iiwa_sim.wording import Unusable

if TYPE_CHECKING:
    from iiwa_sim.controller.state import Snapshot
    from iiwa_sim.options.sources import Given
    from iiwa_sim.simulated_robot import SimulatedRobot
    from iiwa_sim.simulator import Simulator

OPTIONS = {
    "robot": "name or folder of the robot",
    "cell": "path of a cell.toml, which names its robot",
    "protocol": "protocols: iiwa (default), krc4, or both with a comma between",
    "clock": "how simulated time passes: real, 10x, fast (default) or stepped",
    "rate": "ticks per second, 100 to 1000",
    "strict": "reject commands with surplus values: true or false (default: false)",
}
"""Options of command line and ini file, as --iiwa-NAME and iiwa_NAME. The marker takes all of `Simulator`."""
DEFAULTS = {"clock": "fast", "backdoor_port": 0}
ARTIFACT_RATE_HZ = 100
"""States in a simulated second of a recording that is made in case the test fails: with the clock `fast` each
costs more than a tick. `iiwa.record(FILE)` and the marker's `record` keep every tick."""
OPEN_WITH = (
    "to look at it: iiwa-sim plot {path} -o picture.png, or open the file in Foxglove, Lichtblick or "
    "PlotJuggler; the dialogue and events as tables: iiwa-sim export {path} --csv"
)
LONGEST_FILE_NAME = 120

REPORT_S = 10.0
"""Time (s) for which a report waits for the robot's thread, which a test may block."""


class _Robot(NamedTuple):
    """A robot that a report tells of."""

    name: str
    simulator: "Simulator"
    robot: "SimulatedRobot"
    artifact: Path | None
    """The recording that is kept if a test fails."""


_ROBOTS = pytest.StashKey[list[_Robot]]()
_FAILED = pytest.StashKey[bool]()
_SESSION = "iiwa_session"


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("iiwa-sim", "the simulated robot of the fixture iiwa")
    for name, says in OPTIONS.items():
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
        "markers", "iiwa(NAME=VALUE, ...): options of the fixture iiwa, those of iiwa_sim.Simulator"
    )
    folder = config.getoption("--iiwa-artifacts")
    if folder is not None:
        _check_artifacts(config.invocation_params.dir / folder)
    elif config.getoption("--iiwa-artifacts-all"):
        raise pytest.UsageError("--iiwa-artifacts-all: expected --iiwa-artifacts DIR with it")


@pytest.fixture
def iiwa(request: pytest.FixtureRequest) -> "Iterator[Simulator]":
    """Simulated robot that listens on `iiwa.host` and `iiwa.port` and rests at home.

    It is an `iiwa_sim.Simulator`. The marker `iiwa` sets its options.
    """
    shown = request.node.stash.setdefault(_ROBOTS, [])
    with _robot("iiwa", _options_of(request), shown, _artifact(request, request.node.nodeid)) as robot:
        yield robot


@pytest.fixture
def iiwa_factory(request: pytest.FixtureRequest) -> "Iterator[Callable[..., Simulator]]":
    """Function that starts a simulated robot at each call; all robots end with the test.

    `iiwa_factory(robot="lbr_iiwa_14_r820", clock="stepped")` takes the options of the marker `iiwa`. Marker,
    command line and ini file hold for all of them.
    """
    shown = request.node.stash.setdefault(_ROBOTS, [])
    common = _options_of(request)
    with ExitStack() as robots:
        numbers = count(1)

        def start(**given: Any) -> "Simulator":
            options = _marked(common, given, request.path.parent)
            name = f"iiwa_factory {next(numbers)}"
            artifact = _artifact(request, f"{request.node.nodeid} {name}")
            return robots.enter_context(_robot(name, options, shown, artifact))

        yield start


@pytest.fixture(scope="session")
def iiwa_session(request: pytest.FixtureRequest) -> "Iterator[Simulator]":
    """Simulated robot that all tests share; each test finds it as the previous one left it.

    Its options come from command line and ini file only. The report of a failed test shows the dialogue of
    earlier tests, too.
    """
    shown = request.session.stash.setdefault(_ROBOTS, [])
    worker = getattr(request.config, "workerinput", {}).get("workerid")  # of xdist: one robot each
    artifact = _artifact(request, f"{_SESSION}_{worker}" if worker else _SESSION)
    with _robot(_SESSION, _options_of(request, marked=False), shown, artifact) as robot:
        yield robot


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    outcome: Any = yield  # pluggy's own type has no public name in older releases
    stashes = [item.stash]
    if _SESSION in getattr(item, "fixturenames", ()):
        stashes.append(item.session.stash)
    shown = [robot for stash in stashes if _ROBOTS in stash for robot in stash[_ROBOTS]]
    if not shown:
        return
    report = outcome.get_result()
    if report.failed:
        for stash in stashes:
            stash[_FAILED] = True
        for robot in shown:
            try:
                said = robot.simulator.call(robot.robot.dialogue.report, REPORT_S)
                state = robot.simulator.call(robot.robot.state, REPORT_S)
                report.sections.append((f"{robot.name} dialogue", said))
                report.sections.append((f"{robot.name} state", _told(state)))
            except TimeoutError as blocked:
                report.sections.append((robot.name, f"nothing can be told: {blocked}"))
            if robot.artifact is not None:
                how = OPEN_WITH.format(path=shlex.quote(str(robot.artifact)))
                report.sections.append((f"{robot.name} recording", f"{robot.artifact}\n{how}"))
    if call.when == "teardown" and _ROBOTS in item.stash:
        _sweep(item.config, item.stash)
        del item.stash[_ROBOTS]


def pytest_sessionfinish(session: pytest.Session) -> None:
    """The robot that all tests shared has ended by now."""
    if _ROBOTS in session.stash:
        _sweep(session.config, session.stash)


def _check_artifacts(folder: Path) -> None:
    if importlib.util.find_spec("mcap") is None:
        raise pytest.UsageError("--iiwa-artifacts: needs the library mcap: pip install -e '.[record]'")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        told = f"--iiwa-artifacts: {folder}: no folder can be there: {fault.strerror}"
        raise pytest.UsageError(told) from None


def _artifact(request: pytest.FixtureRequest, name: str) -> Path | None:
    """Return a unique file for the recording of a test that may fail; None if none is asked for."""
    folder = request.config.getoption("--iiwa-artifacts")
    if folder is None:
        return None
    text = re.sub(r"[^\w.-]+", "_", name, flags=re.ASCII).strip("_")
    if len(text) > LONGEST_FILE_NAME or text != name.replace("::", "_").replace("/", "_"):
        text = f"{text[:LONGEST_FILE_NAME]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    return Path(request.config.invocation_params.dir / folder / f"{text}.mcap")


def _sweep(config: pytest.Config, stash: pytest.Stash) -> None:
    """Keep no recordings of robots whose tests have passed."""
    if config.getoption("--iiwa-artifacts-all") or stash.get(_FAILED, False):
        return
    for robot in stash[_ROBOTS]:
        if robot.artifact is not None:
            with suppress(OSError):
                robot.artifact.unlink()


def _options_of(request: pytest.FixtureRequest, *, marked: bool = True) -> "Given":
    """Return the options of defaults, ini file, command line and markers; the last of these hold."""
    from iiwa_sim.options.sources import KEYWORDS, Place, from_names, merged

    config = request.config
    ini_folder = config.inipath.parent if config.inipath is not None else config.rootpath
    ini = {name: config.getini(f"iiwa_{name}") or None for name in OPTIONS}
    line = {name: config.getoption(f"iiwa_{name}") for name in OPTIONS}
    try:
        options = merged(
            from_names(DEFAULTS, KEYWORDS),
            from_names(ini, Place("key", " = ", "iiwa_", is_text=True), ini_folder),
            from_names(line, Place("key", " ", "--iiwa-", is_text=True), config.invocation_params.dir),
        )
    except Unusable as fault:
        raise _failure(fault) from None
    for marker in reversed(list(request.node.iter_markers("iiwa"))) if marked else ():  # the function's last
        if marker.args:
            raise _failure(f"{marker.args[0]!r}: expected NAME=VALUE")
        options = _marked(options, marker.kwargs, request.path.parent)
    return options


def _marked(options: "Given", keywords: dict[str, Any], folder: Path) -> "Given":
    """Return options with those of keywords, whose paths start at the folder of the test."""
    from iiwa_sim.options.sources import KEYWORDS, from_names, merged

    try:
        return merged(options, from_names(keywords, KEYWORDS, folder))
    except Unusable as fault:
        raise _failure(fault) from None


def _failure(why: object) -> BaseException:
    """Return a failure that the report shows in one line."""
    return pytest.fail.Exception(f"fixture iiwa: {why}", pytrace=False)


@contextmanager
def _robot(name: str, options: "Given", shown: list[_Robot], artifact: Path | None) -> "Iterator[Simulator]":
    """A simulator while the context is open, and what a report shows of its robots from then on."""
    from iiwa_sim.options.model import Settings
    from iiwa_sim.simulator import Simulator

    try:
        simulator = Simulator(settings=Settings(**options))
        for robot in simulator.robots.values():
            robot.dialogue.remember()
        simulator.__enter__()
    except Unusable as fault:
        raise _failure(fault) from None
    robots = simulator.robots.values()
    shown += [_Robot(f"{name} {each.name}".rstrip(), simulator, each, artifact) for each in robots]
    try:
        if artifact is not None:
            simulator.record(artifact, min(ARTIFACT_RATE_HZ, simulator.clock.rate_hz))
        yield simulator
    except Unusable as fault:
        raise _failure(fault) from None
    finally:
        try:
            simulator.__exit__(None, None, None)
        except TimeoutError as blocked:
            raise _failure(f"the robot could not be ended: {blocked}") from None


def _told(state: "Snapshot") -> str:
    """Return a state as text, one field per line."""
    return "\n".join(f"{name}: {_value(getattr(state, name))}" for name in state.__struct_fields__)


def _value(value: object) -> str:
    if isinstance(value, tuple) and value and all(isinstance(each, float) for each in value):
        return " ".join(str(round(each, 9) + 0.0) for each in value)
    if isinstance(value, tuple) and all(isinstance(each, bool) for each in value):
        return " ".join(str(int(each)) for each in value)
    return str(value)
