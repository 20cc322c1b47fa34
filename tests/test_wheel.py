"""The wheel as a user gets it: what is in it, and that it works in an environment of its own."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

from iiwa_sim.client import Iiwa
from tests.processes import running

pytestmark = pytest.mark.slow  # a wheel is built, and installed into environments

SOURCE = Path(__file__).parent.parent
EXAMPLES = SOURCE / "tests" / "examples"
SHIPPED = ["iiwa_sim", "protocol", "robots", "README.md", "LICENSE"]
BUILT_BY = ["pyproject.toml", "setup.py", "build_backend.py", "MANIFEST.in"]
NOT_COPIED = shutil.ignore_patterns("__pycache__", "*.so")


def pip(*arguments: str | Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pip", "--disable-pip-version-check", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy, so that nothing left over from another build gets in, and none is left behind."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    for name in [*SHIPPED, *BUILT_BY]:
        if (SOURCE / name).is_dir():
            shutil.copytree(SOURCE / name, source / name, ignore=NOT_COPIED)
        else:
            shutil.copy(SOURCE / name, source)
    pip("wheel", "--no-deps", "--wheel-dir", folder, source)
    (built,) = folder.glob("*.whl")
    return built


def test_what_is_in_the_wheel(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    folders = {name.split("/")[0] for name in names}
    assert {folder for folder in folders if not folder.endswith(".dist-info")} == {"iiwa_sim"}, (
        "a module called protocol or robots would collide with the projects that use our fixture"
    )
    code = {str(path.relative_to(SOURCE)) for path in (SOURCE / "iiwa_sim").rglob("*.py")}
    data = {
        f"iiwa_sim/{path.relative_to(SOURCE)}"
        for folder in ("protocol", "robots")
        for path in (SOURCE / folder).rglob("*")
        if path.suffix
        in (".toml", ".json", ".urdf", ".srdf", ".yaml", ".xml", ".py", ".msg", ".srv", ".action")
    }
    assert data
    assert code | data | {"iiwa_sim/py.typed"} <= names
    kernels = {name.removesuffix(".py") for name in code if name.endswith("_kernel.py")}
    assert kernels
    assert {kernel + sysconfig.get_config_var("EXT_SUFFIX") for kernel in kernels} <= names


@pytest.fixture
def installed(wheel: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The programs of an environment of its own with the wheel, and no way to the checkout."""
    home = tmp_path / "fresh"
    venv.create(home, with_pip=False)
    pip("--python", home / "bin" / "python", "install", "--no-deps", "--no-index", wheel)
    # The libraries are borrowed from this environment instead of downloaded again. Path files in a folder
    # that is named by a path file are not read: an editable iiwa_sim there stays out.
    (packages,) = (home / "lib").glob("python*/site-packages")
    borrowed = [sysconfig.get_path("purelib"), *pinocchio_paths()]
    (packages / "borrowed.pth").write_text("\n".join(borrowed) + "\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    where = subprocess.run(
        [home / "bin" / "python", "-c", "import iiwa_sim.simulator; print(iiwa_sim.__file__)"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert where.stdout == f"{packages / 'iiwa_sim' / '__init__.py'}\n", where.stderr
    return home / "bin"


@pytest.mark.requirement("FRA003")
def test_the_installed_program_answers(installed: Path) -> None:
    with running(program=(str(installed / "iiwa-sim"),)) as simulator:
        with Iiwa("127.0.0.1", simulator.port) as robot:
            robot.hello()
            assert robot.get_status() == "stopped"
        assert simulator.ends(signal.SIGTERM)[0] == 0


@pytest.mark.parametrize(("name", "tests"), [("driver_project", 3), ("krc4_driver_project", 5)])
def test_a_drivers_project_has_the_fixture(installed: Path, tmp_path: Path, name: str, tests: int) -> None:
    project = tmp_path / name
    shutil.copytree(EXAMPLES / name, project, ignore=shutil.ignore_patterns("__pycache__"))
    done = subprocess.run(
        [installed / "python", "-m", "pytest", "-W", "error", "-p", "no:asyncio"],
        cwd=project,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{tests} passed" in done.stdout


def pinocchio_paths() -> list[str]:
    """Folders that the path files of this environment put on sys.path, such as Pinocchio's."""
    purelib = sysconfig.get_path("purelib")
    return [path for path in sys.path if path.startswith(purelib + os.sep) and Path(path).is_dir()]
