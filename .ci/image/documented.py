"""The commands that pages name for a container, run with the image that has just been built.

Containers here share the network of the machine, where ports may be taken. So `-p 30000:30000` is not
handed on: the port is a free one, by a variable. All else is as it is written.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

from engine import Engine, EngineFault
from trial import free_port, running

SOURCE = Path(__file__).parent.parent.parent
PAGES = ("README.md", "docs/container.md")
IMAGE = "iiwa-sim"
RUN = re.compile(r"docker run ([^`\n#]+)")


def try_documented(engine: Engine) -> None:
    """Raises `EngineFault` where a command, or a service of compose.yaml, does not answer `hello`."""
    commands = sorted(set(_commands()))
    if not commands:
        raise EngineFault(f"{' and '.join(PAGES)}: expected a docker run {IMAGE}")
    for words in commands:
        _answers(engine, f"docker run {shlex.join(words)}", *_split(list(words)))
    for name, options in _services():
        _answers(engine, f"{name} of compose.yaml", options, [])
    print(f"as documented: {len(commands)} docker run, and compose.yaml", flush=True)


def _commands() -> Iterator[tuple[str, ...]]:
    for page in PAGES:
        for found in RUN.finditer((SOURCE / page).read_text()):
            yield tuple(shlex.split(found[1]))


def _split(words: list[str]) -> tuple[list[str], list[str]]:
    """Options of `docker run` that are handed on, and those of iiwa-sim behind the name of the image."""
    options: list[str] = []
    while words and words[0] != IMAGE:
        option = words.pop(0)
        if option in ("-e", "--env"):
            options += ["--env", words.pop(0)]
        elif option in ("-p", "--publish"):
            words.pop(0)
        elif option != "--rm":  # containers of a trial are removed in any case
            raise EngineFault(f"docker run {option}: expected an option that .ci/image/documented.py knows")
    return options, words[1:]


def _services() -> Iterator[tuple[str, list[str]]]:
    """Of compose.yaml, as Compose reads it: with all that an engine is asked for, but the ports."""
    compose = shutil.which(
        "docker-compose", path=f"{SOURCE / '.venv' / 'bin'}{os.pathsep}{os.environ['PATH']}"
    )
    if compose is None:
        print("compose.yaml: not tried, there is no docker-compose to read it", flush=True)
        return
    read = [
        compose,
        "--file",
        str(SOURCE / "compose.yaml"),
        "--profile",
        "five",
        "config",
        "--format",
        "json",
    ]
    done = subprocess.run(read, capture_output=True, text=True, timeout=60, check=False)
    if done.returncode:
        raise EngineFault(f"compose.yaml cannot be read: {done.stderr}")
    for name, service in json.loads(done.stdout)["services"].items():
        options = ["--read-only"] if service["read_only"] else []
        options += [word for each in service["cap_drop"] for word in ("--cap-drop", each)]
        options += [word for each in service["security_opt"] for word in ("--security-opt", each)]
        for variable, value in service["environment"].items():
            options += ["--env", f"{variable}={value or ''}"]
        yield name, options


def _answers(engine: Engine, what: str, options: list[str], behind: list[str]) -> None:
    port = free_port()
    variables = ["--env", f"IIWA_SIM_PORT={port}"]
    with running(engine, IMAGE, *options, *variables, then=tuple(behind)) as container:
        found = container.answer(port, b"hello\r\n")
    if found != b"hello\r\n":
        raise EngineFault(f"{what}: expected hello, found {found!r}")
