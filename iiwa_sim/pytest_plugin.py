"""The fixtures `iiwa`, `iiwa_factory` and `iiwa_session`: robots in threads of the tests' process.

Nothing of the simulator is imported before a test asks for a fixture. Options come from the marker `iiwa`,
where there is none from the command line, then from the ini file.
"""

import re
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from iiwa_sim.wording import Unusable

if TYPE_CHECKING:
    from iiwa_sim.options.model import Settings
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
DEFAULTS = {"clock": "fast", "backdoor_port": 0}  # with which a robot remembers the dialogue
ARTIFACT_RATE_HZ = 100
"""States per simulated second of the recording for a failed test; each costs more than a fast tick.
`iiwa.record(FILE)` and the marker's `record` keep every tick."""
LONGEST_FILE_NAME = 200
LONG_NUMBER = re.compile(r"-?\d+\.\d{7,}(e-\d+)?|-?\d+(\.\d+)?e-\d+")
REPORT_S = 10.0
"""Time (s) for which a report waits for the robot's thread, which a test may block."""
_ROBOTS = pytest.StashKey[list[tuple[str, "Simulator", Path | None]]]()
"""Name, simulator, and the recording that is kept if the test fails."""
_FAILED = pytest.StashKey[bool]()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("iiwa-sim", "the simulated robot of the fixture iiwa")
    for name, says in OPTIONS.items():
        group.addoption(f"--iiwa-{name}", metavar=name.upper(), help=says)
        parser.addini(f"iiwa_{name}", says)
    text = "keep recordings of the robots of failed tests there, one file for each, as .mcap"
    group.addoption("--iiwa-artifacts", metavar="DIR", help=text)


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", "iiwa(NAME=VALUE, ...): options of the fixture, as of iiwa_sim.Simulator"
    )


@pytest.fixture
def iiwa(request: pytest.FixtureRequest) -> "Iterator[Simulator]":
    """Simulated robot that listens on `iiwa.host` and `iiwa.port` and rests at home.

    It is an `iiwa_sim.Simulator`. The marker `iiwa` sets its options.
    """
    with _running(request, "iiwa", {}) as robot:
        yield robot


@pytest.fixture
def iiwa_factory(request: pytest.FixtureRequest) -> "Iterator[Callable[..., Simulator]]":
    """Function that starts a simulated robot at each call; all robots end with the test.

    `iiwa_factory(robot="lbr_iiwa_14_r820", clock="stepped")` takes the options of the marker `iiwa`. Marker,
    command line and ini file hold for all of them.
    """
    numbers = count(1)
    with ExitStack() as robots:

        def start(**options: Any) -> "Simulator":
            return robots.enter_context(_running(request, f"iiwa_factory {next(numbers)}", options))

        yield start


@pytest.fixture(scope="session")
def iiwa_session(request: pytest.FixtureRequest) -> "Iterator[Simulator]":
    """Simulated robot that all tests share; each test finds it as the previous one left it.

    Its options come from command line and ini file only. The report of a failed test shows the dialogue since
    the last `dialogue.forget()`.
    """
    with _running(request, "iiwa_session", {}) as robot:
        yield robot


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    own = item.stash.get(_ROBOTS, [])
    if report.failed:
        item.stash[_FAILED] = True
        shared = item.session.stash.get(_ROBOTS, [])
        for robot in own + (shared if "iiwa_session" in getattr(item, "fixturenames", ()) else []):
            report.sections += _sections(*robot)
    if call.when == "teardown" and own:
        for _, _, artifact in own:
            if artifact is not None and _FAILED not in item.stash:
                artifact.unlink(missing_ok=True)
        del item.stash[_ROBOTS]
    return report


def _sections(fixture: str, simulator: "Simulator", artifact: Path | None) -> Iterator[tuple[str, str]]:
    """Return title and text of the report of a simulator."""
    for robot in simulator.robots.values():
        name = f"{fixture} {robot.name}".rstrip()
        yield f"{name} dialogue", robot.dialogue.report()
        try:
            state = simulator.call(robot.state, REPORT_S)
            text = "\n".join(f"{key}: {getattr(state, key)}" for key in state.__struct_fields__)
            text = LONG_NUMBER.sub(lambda found: f"{round(float(found[0]), 6) + 0.0}", text)
        except Exception as fault:  # noqa: BLE001 - of any kind: it must not end the run of all tests
            text = f"unknown: {fault}"
        yield f"{name} state", text
    if artifact is not None:
        yield f"{fixture} recording", f"{artifact}\nto look at it: iiwa-sim show {artifact}"


@contextmanager
def _running(request: pytest.FixtureRequest, name: str, options: Mapping[str, Any]) -> "Iterator[Simulator]":
    """Run a simulator while the context is open; reports include it."""
    from iiwa_sim.simulator import Simulator

    folder, artifact = request.config.getoption("--iiwa-artifacts"), None
    with ExitStack() as running:
        try:
            simulator = Simulator(settings=_settings(request, options))
            running.enter_context(simulator)
            if folder is not None and request.scope == "function":
                file = re.sub(r"[^\w.-]+", "_", f"{request.node.nodeid} {name}", flags=re.ASCII)
                artifact = request.config.invocation_params.dir / folder / f"{file[-LONGEST_FILE_NAME:]}.mcap"
                artifact.parent.mkdir(parents=True, exist_ok=True)
                simulator.record(artifact, ARTIFACT_RATE_HZ)
        except (Unusable, OSError) as fault:  # OSError: no folder for recordings
            raise pytest.fail.Exception(f"fixture iiwa: {fault}", pytrace=False) from None
        request.node.stash.setdefault(_ROBOTS, []).append((name, simulator, artifact))
        yield simulator
        if request.scope == "session":
            del request.node.stash[_ROBOTS]  # the session lives to the exit, where nanobind reports leaks


def _settings(request: pytest.FixtureRequest, options: Mapping[str, Any]) -> "Settings":
    """Return settings of defaults, ini file, command line, markers and `options`; the last of these hold.

    Paths of markers and `options` start at the folder of the test. Raises SettingError.
    """
    from iiwa_sim.options.model import SettingError, Settings
    from iiwa_sim.options.sources import KEYWORDS, Place, from_names, merged

    config = request.config
    ini_folder = config.inipath.parent if config.inipath is not None else config.rootpath
    ini = {name: config.getini(f"iiwa_{name}") or None for name in OPTIONS}
    line = {name: config.getoption(f"iiwa_{name}") for name in OPTIONS}
    given = merged(
        from_names(DEFAULTS, KEYWORDS),
        from_names(ini, Place("key", " = ", "iiwa_", is_text=True), ini_folder),
        from_names(line, Place("key", " ", "--iiwa-", is_text=True), config.invocation_params.dir),
    )
    markers = list(request.node.iter_markers("iiwa"))[::-1]  # the function's last
    for marker in markers:
        if marker.args:
            raise SettingError(f"{marker.args[0]!r}: expected NAME=VALUE")
    for keywords in (*(marker.kwargs for marker in markers), options):
        given = merged(given, from_names(keywords, KEYWORDS, request.path.parent if keywords else None))
    return Settings(**given)
