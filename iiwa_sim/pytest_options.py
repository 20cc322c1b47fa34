"""Options of the fixtures: from the marker `iiwa`, the command line and the ini file, the nearest first."""

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import pytest

DEFAULT_CLOCK = "fast"
"""A driver's tests wait for motion most of their time, and few of them ask how long it takes."""


class _Kind(NamedTuple):
    kind: type | tuple[type, ...]
    expected: str


_PATH = _Kind((str, os.PathLike), "a name or a path")
_FILE = _Kind((str, os.PathLike), "the path of a file")
_SECONDS = _Kind((int, float), "a number of seconds")
_PORT = _Kind(int, "a port")
OPTIONS = {
    "robot": _PATH,
    "cell": _PATH,
    "dialects": _Kind((list, tuple), "a list, of iiwa or krc4 or both"),
    "clock": _Kind(str, "real, 10x, fast or stepped"),
    "rate_hz": _Kind(int, "a whole number"),
    "servo_timeout_s": _SECONDS,
    "port": _PORT,
    "status_port": _PORT,
    "status_rate_hz": _Kind(int, "a whole number"),
    "strict": _Kind(bool, "True or False"),
    "exclusive": _Kind(bool, "True or False"),
    "reconnect_pause_s": _SECONDS,
    "transcript": _FILE,
    "record": _FILE,
    "record_rate_hz": _Kind(int, "a whole number"),
}
"""What the marker takes."""
INI = {
    "robot": "name or folder of the robot",
    "cell": "path of a cell.toml, which names its robot",
    "dialect": "what is spoken: iiwa (default), krc4, or both with a comma between",
    "clock": f"how simulated time passes: real, 10x, fast or stepped (default: {DEFAULT_CLOCK})",
    "rate": "ticks per second, 100 to 1000",
    "strict": "whether more values than a command takes are an error: true or false (default: false)",
}
"""What command line and ini file take, as --iiwa-NAME and iiwa_NAME, with what each says of itself."""
_NAMES = {"rate": "rate_hz", "dialect": "dialects"}


def options_of(request: pytest.FixtureRequest, *, marked: bool = True) -> dict[str, Any]:
    """What is handed on to `Simulator`; the nearest says what holds. Fails the test for a wrong marker."""
    config = request.config
    ini_folder = config.inipath.parent if config.inipath is not None else config.rootpath
    options: dict[str, Any] = {"clock": DEFAULT_CLOCK, "backdoor_port": 0}
    take(options, {name: config.getini(f"iiwa_{name}") or None for name in INI}, ini_folder)
    take(options, {name: config.getoption(f"iiwa_{name}") for name in INI}, config.invocation_params.dir)
    markers = list(request.node.iter_markers("iiwa")) if marked else []
    for marker in reversed(markers):  # those of the function last
        if marker.args:
            raise failure(f"{marker.args[0]!r}: expected NAME=VALUE")
        check(marker.kwargs)
        take(options, marker.kwargs, request.path.parent)
    return options


def check(given: Mapping[str, Any]) -> None:
    """Fails the test for what is no option, or not of its kind."""
    for name, value in given.items():
        if name not in OPTIONS:
            raise failure(f"{name}: expected one of {', '.join(OPTIONS)}")
        kind = OPTIONS[name].kind
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            raise failure(f"{name}={value!r}: expected {OPTIONS[name].expected}")


def take(options: dict[str, Any], given: dict[str, Any], folder: Path) -> None:
    """Put what is given into the options; paths start at the folder. Fails the test for a wrong value."""
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
            raise failure(f"strict {given['strict']!r}: expected true or false")
        given["strict"] = given["strict"] == "true"
    if isinstance(given.get("rate_hz"), str):
        if not given["rate_hz"].isdigit():
            raise failure(f"rate {given['rate_hz']!r}: expected a whole number")
        given["rate_hz"] = int(given["rate_hz"])
    options.update(given)


def failure(why: str) -> BaseException:
    """A failure that the report shows in one line."""
    return pytest.fail.Exception(f"fixture iiwa: {why}", pytrace=False)
