"""The recipes for CI: of their schemas, and their commands run as the CI would, but for what installs."""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml
from check_jsonschema import main as check_jsonschema
from click.testing import CliRunner

from iiwa_sim.cli import server_options
from iiwa_sim.cli.environment import unknown_variables
from iiwa_sim.client import Iiwa
from tests.processes import running, succeeds
from tests.test_health import free_ports

ROOT = Path(__file__).parent.parent.parent
RECIPES = ROOT / "examples" / "ci"
BIN = Path(sys.executable).parent
SCHEMAS = {
    "github.yml": "vendor.github-workflows",
    "gitlab.yml": "vendor.gitlab-ci",
    "action.yml": "vendor.github-actions",
    "release.yml": "vendor.github-workflows",
    "test.yml": "vendor.github-workflows",
}
FILES = [RECIPES / "github.yml", RECIPES / "gitlab.yml", ROOT / "action.yml"]
FILES += sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def read(file: Path) -> dict[str, Any]:
    return dict(yaml.safe_load(file.read_text()))


def run(script: str, folder: Path, **environment: str) -> str:
    """What a script says that bash runs as GitHub and GitLab have it."""
    return succeeds(
        ["bash", "-eo", "pipefail", "-c", script],
        cwd=folder,
        env=os.environ | {"PATH": f"{BIN}:{os.environ['PATH']}"} | environment,
    )


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_it_is_of_its_schema(file: Path, tmp_path: Path) -> None:
    def faults(path: Path) -> int:
        words = ["--builtin-schema", SCHEMAS[file.name], str(path)]
        return CliRunner().invoke(check_jsonschema, words).exit_code

    assert faults(file) == 0
    broken = tmp_path / file.name
    key = {"action.yml": "shell: bash", "gitlab.yml": "script:"}.get(file.name, "runs-on:")
    broken.write_text(file.read_text().replace(f" {key}", f" not-{key}"))
    assert faults(broken) == 1


@contextmanager
def action_started(folder: Path, **inputs: str) -> Iterator[tuple[dict[str, str], int]]:
    """The step `start` of action.yml, run as on a runner; its outputs, and the process it has left."""
    (folder / "iiwa-sim" / "bin").mkdir(parents=True)
    (folder / "iiwa-sim" / "bin" / "iiwa-sim").symlink_to(BIN / "iiwa-sim")  # as the step before installs it
    output = folder / "output"
    (step,) = (each for each in read(ROOT / "action.yml")["runs"]["steps"] if each["id"] == "start")
    environment = {
        name: inputs[re.sub(r".*inputs\.(\w+).*", r"\1", text)] for name, text in step["env"].items()
    }
    run(step["run"], folder, RUNNER_TEMP=str(folder), GITHUB_OUTPUT=str(output), **environment)
    outputs = dict(line.split("=", 1) for line in output.read_text().splitlines())
    process = int(outputs.pop("process"))
    try:
        yield outputs, process
    finally:
        os.kill(process, signal.SIGTERM)


def test_the_action_starts_a_robot_and_gives_its_ports(tmp_path: Path) -> None:
    declared = read(ROOT / "action.yml")["outputs"]
    with action_started(tmp_path, options="--clock fast --robot lbr_iiwa_14_r820") as (outputs, _):
        for name in outputs:
            assert declared[name]["value"] == f"${{{{ steps.start.outputs.{name} }}}}"
        assert set(declared) == {*outputs, "host"}
        with Iiwa(declared["host"]["value"], int(outputs["port"])) as robot:
            robot.hello()
        health = f"http://127.0.0.1:{outputs['backdoor-http-port']}/healthz"
        told = run(
            f"{sys.executable} -c \"import urllib.request as u; print(u.urlopen('{health}').read())\"",
            tmp_path,
        )
        assert "ok" in told


def test_the_action_tells_why_there_is_no_robot(tmp_path: Path) -> None:
    with (
        pytest.raises(AssertionError, match="argument --clock: 'fats' is not real"),
        action_started(tmp_path, options="--clock fats"),
    ):
        pass


@pytest.mark.slow
def test_the_action_installs_what_it_is_told(tmp_path: Path) -> None:
    (tmp_path / "tiny" / "tiny").mkdir(parents=True)
    (tmp_path / "tiny" / "pyproject.toml").write_text(
        "[build-system]\nrequires = []\nbuild-backend = 'backend'\nbackend-path = ['.']\n"
        "[project]\nname = 'tiny'\nversion = '1'\n"
    )
    (tmp_path / "tiny" / "backend.py").write_text(
        "import zipfile\n"
        "def build_wheel(folder, *_):\n"
        "    name = 'tiny-1-py3-none-any.whl'\n"
        "    with zipfile.ZipFile(f'{folder}/{name}', 'w') as wheel:\n"
        "        wheel.writestr('tiny.py', '')\n"
        "        wheel.writestr('tiny-1.dist-info/METADATA', 'Metadata-Version: 2.1\\n"
        "Name: tiny\\nVersion: 1\\n')\n"
        "        wheel.writestr('tiny-1.dist-info/WHEEL', 'Wheel-Version: 1.0\\nTag: py3-none-any\\n')\n"
        "        wheel.writestr('tiny-1.dist-info/RECORD', '')\n"
        "    return name\n"
    )
    (step,) = (each for each in read(ROOT / "action.yml")["runs"]["steps"] if each["id"] == "install")
    assert set(step["env"]) == {"REQUIREMENT", "PYTHON"}
    given = {"REQUIREMENT": str(tmp_path / "tiny"), "PYTHON": sys.executable}
    run(step["run"], tmp_path, RUNNER_TEMP=str(tmp_path), **given)
    run("iiwa-sim/bin/python -I -c 'import tiny'", tmp_path)


def project(folder: Path) -> Path:
    """A driver's project, with the script that stands for its tests."""
    (folder / "check_robot.py").symlink_to(RECIPES / "check_robot.py")
    (folder / "test_driver.py").write_text(
        "def test_it_answers(iiwa):\n    assert iiwa.state().status == 'stopped'\n"
    )
    return folder


@pytest.mark.parametrize("job", [pytest.param("fixture", marks=pytest.mark.slow), "action", "service"])
def test_the_jobs_of_github_pass(job: str, tmp_path: Path) -> None:
    folder, steps = project(tmp_path), read(RECIPES / "github.yml")["jobs"][job]["steps"]
    (script,) = (step["run"] for step in steps if step.get("name") == "test")
    with running("--clock", "fast") as robot:
        said = run(
            script.replace("30000", str(robot.port)),
            folder,
            ROBOT="lbr_iiwa_14_r820",
            ROBOT_PORT=str(robot.port),
        )
    assert "1 passed" in said if job == "fixture" else "get status -> " in said


def test_the_job_of_github_with_uvx_passes(tmp_path: Path) -> None:
    """With a program in the place of uvx that finds the iiwa-sim of this environment, on a free port."""
    folder, steps = project(tmp_path), read(RECIPES / "github.yml")["jobs"]["uvx"]["steps"]
    (script,) = (step["run"] for step in steps if step.get("name") == "test")
    uvx = folder / "uvx"
    uvx.write_text(f'#!/bin/sh\necho $$ > robot.pid\nexec {BIN}/"$@"\n')
    uvx.chmod(0o755)
    (port,) = free_ports(1)
    try:
        said = run(script.replace("30000", str(port)), folder, PATH=f"{folder}:{os.environ['PATH']}")
    finally:
        os.kill(int((folder / "robot.pid").read_text()), signal.SIGTERM)
    assert "get status -> " in said


@pytest.mark.parametrize("job", [pytest.param("fixture", marks=pytest.mark.slow), "service"])
def test_the_jobs_of_gitlab_pass(job: str, tmp_path: Path) -> None:
    recipe = read(RECIPES / "gitlab.yml")[job]
    with running("--clock", "fast") as robot:
        variables = {"ROBOT": "lbr_iiwa_7_r800", "ROBOT_HOST": "127.0.0.1", "ROBOT_PORT": str(robot.port)}
        said = run("\n".join(recipe["script"]), project(tmp_path), **variables)
    assert "1 passed" in said if job == "fixture" else "get status -> " in said


def test_variables_of_the_services_are_options() -> None:
    github = read(RECIPES / "github.yml")["jobs"]["service"]["services"]["robot"]["env"]
    gitlab = read(RECIPES / "gitlab.yml")["service"]["variables"]
    for environment in (github, gitlab):
        assert unknown_variables(server_options.server_parser(), environment) == []
        assert server_options.parsed([], environment).clock.name == "fast"
