"""What the build says where it cannot do without what is missing, and what is released."""

from __future__ import annotations

import os
import platform
import re
import runpy
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.kernels import stamp
from tests.processes import ended
from tests.robot.arms import copy_of_robot
from tests.talking import DEADLINE_S

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


@pytest.fixture
def backend(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    monkeypatch.setenv("CC", "cc")  # so that it leaves the environment alone
    monkeypatch.delenv("CXX", raising=False)
    return runpy.run_path(str(ROOT / "build_backend.py"))


def test_on_windows_it_says_what_is_missing(backend: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(
        SystemExit, match=r"pin .* has no wheels for Windows: take WSL 2 or the container image"
    ):
        backend["get_requires_for_build_wheel"]()


def test_on_arm_linux_without_a_compiler_it_says_what_to_install(
    backend: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(platform, "machine", lambda: "aarch64")
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(SystemExit, match=r"ruckig has no wheels for ARM Linux.*apt install g"):
        backend["get_requires_for_build_wheel"]()


def test_elsewhere_it_asks_for_what_it_needs(
    backend: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    backend["_check_platform"]()


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("pinocchio", "pip install pin"),
        pytest.param("ruckig", "pip install ruckig", marks=pytest.mark.slow),
    ],
)
def test_a_library_that_is_not_installed_is_told_in_one_line(name: str, told: str, tmp_path: Path) -> None:
    """For a robot of a user's own: those that come along start without Pinocchio."""
    robot = copy_of_robot(tmp_path / "robot")
    hidden = f"import sys; sys.modules['{name}'] = None; from iiwa_sim.cli import main; sys.exit(main())"
    words = [sys.executable, "-c", hidden, "--port", "0", "--robot", str(robot)]
    done = ended(words)
    assert done.returncode == 2
    assert re.fullmatch(rf"iiwa-sim: {name} is not installed: {told}; [^\n]+\n", done.stderr)


def test_the_pythons_that_are_named_are_those_that_are_built_and_tested() -> None:
    named = {
        found[1]
        for each in PROJECT["project"]["classifiers"]
        if (found := re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", each))
    }
    built = {f"3.{each[3:-2]}" for each in PROJECT["tool"]["cibuildwheel"]["build"]}
    workflow = (ROOT / ".github" / "workflows" / "test.yml").read_text()
    assert named == built == set(re.findall(r'"(3\.\d+)"', workflow.split("matrix:")[1].split("os:")[0]))


@pytest.mark.slow
def test_an_editable_installation_compiles_a_kernel_once_and_make_when_it_was_edited(tmp_path: Path) -> None:
    for name in ("pyproject.toml", "README.md", "LICENSE", "setup.py", "build_backend.py"):
        shutil.copy(ROOT / name, tmp_path)
    package = tmp_path / "iiwa_sim"
    for folder in (package, tmp_path / "protocol", tmp_path / "robots"):
        folder.mkdir()
    shutil.copy(ROOT / "iiwa_sim" / "kernels.py", package)
    (package / "one_kernel.py").write_text("def value():\n    return 1\n")
    (package / "two_kernel.py").write_text("def value():\n    return 2\n")
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    one, two = (package / f"{name}_kernel{suffix}" for name in ("one", "two"))
    by_pip = ["-c", "import build_backend; build_backend.build_editable('wheels')"]  # the hook that pip calls
    by_make = ["build_backend.py"]

    def build(words: list[str]) -> tuple[int, int]:
        subprocess.run([sys.executable, *words], cwd=tmp_path, check=True, capture_output=True)
        for each in (one, two):
            text = package / each.name.replace(suffix, ".py")
            assert each.with_suffix(".stamp").read_text() == stamp(text)
        return one.stat().st_mtime_ns, two.stat().st_mtime_ns

    made = build(by_pip)
    assert build(by_make) == made == build(by_pip)
    (package / "two_kernel.py").write_text("def value():\n    return 3\n")
    edited = build(by_make)
    assert edited[0] == made[0]
    assert edited[1] > made[1]
    (package / "one_kernel.pxd").write_text("cpdef value()\n")
    declared = build(by_pip)
    assert declared[0] > edited[0]
    assert declared[1] == edited[1]
    one.unlink()
    assert build(by_make)[0] > declared[0], "a compiled module that is gone"


def git(folder: Path, *words: str) -> None:
    subprocess.run(["git", "-C", str(folder), *words], check=True, capture_output=True)


@pytest.mark.parametrize(
    ("file", "message", "code"),
    [
        ("docs/a.md", "a page", 0),
        ("iiwa_sim/a.py", "a change", 1),
        ("iiwa_sim/a.py", "nothing to notice\n\nChangelog: none", 0),
        ("CHANGELOG.md", "a line", 0),
    ],
)
def test_the_gate_of_the_changelog(file: str, message: str, code: int, tmp_path: Path) -> None:
    git(tmp_path, "init", "--initial-branch", "main")
    git(tmp_path, "config", "user.name", "a")
    git(tmp_path, "config", "user.email", "a@example.org")
    git(tmp_path, "commit", "--allow-empty", "--message", "first")
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_text("new")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "--message", message)
    done = subprocess.run(
        [str(ROOT / ".ci" / "changelog"), "HEAD~1"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    assert done.stderr.count("\n") == code


def test_a_tag_has_to_have_a_section_in_the_changelog(tmp_path: Path) -> None:
    (tmp_path / ".ci").mkdir()
    shutil.copy(ROOT / ".ci" / "version", tmp_path / ".ci")

    def told(section: str) -> str:
        (tmp_path / "CHANGELOG.md").write_text(f"# Changelog\n\n## {section}\n\n- A line.\n\n## 0.1.0\n")
        words = [str(tmp_path / ".ci" / "version"), "1.2.3"]
        return subprocess.run(words, capture_output=True, text=True, check=False).stderr

    assert told("1.2.3 (2026-12-01)") == ""
    assert told("1.2.2") == "the tag says 1.2.3, the newest section of CHANGELOG.md is 1.2.2\n"
    assert told("1.2.3 (unreleased)") == "CHANGELOG.md still calls 1.2.3 unreleased\n"


def version_of(folder: Path, pretended: str = "") -> str:
    """Of what setuptools would build there."""
    words = [sys.executable, "-c", "from setuptools import setup; setup(packages=[])", "--version"]
    here = {**os.environ, "SETUPTOOLS_SCM_PRETEND_VERSION_FOR_IIWA_SIM": pretended}
    done = subprocess.run(
        words, cwd=folder, env=here, capture_output=True, text=True, timeout=DEADLINE_S, check=True
    )
    return done.stdout.split()[-1]


@pytest.mark.slow
def test_the_version_is_that_of_a_tag_also_where_there_is_none(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    fallback = PROJECT["tool"]["setuptools_scm"]["fallback_version"]
    assert fallback.endswith(".dev0")
    assert version_of(source) == fallback, "an archive, or what an image is built of"
    assert version_of(source, "v1.2.3") == "1.2.3", "what the workflow of a release says"
    git(source, "init", "--initial-branch", "main")
    git(source, "config", "user.name", "a")
    git(source, "config", "user.email", "a@example.org")
    git(source, "add", ".")
    git(source, "commit", "--message", "first")
    assert ".dev" in version_of(source)
    git(source, "tag", "v1.2.3")
    assert version_of(source) == "1.2.3"
    git(source, "commit", "--allow-empty", "--message", "second")
    assert version_of(source).startswith("1.2.4.dev1+g")
    git(tmp_path, "clone", "--depth", "1", "--no-tags", source.as_uri(), "shallow")
    assert ".dev" in version_of(tmp_path / "shallow")
