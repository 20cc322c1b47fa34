"""What is told of a kernel that is not compiled, or was edited since."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest

from iiwa_sim.kernels import stamp

PACKAGE = Path(__file__).parent.parent / "iiwa_sim"
KERNEL = Path("robot") / "trigonometry_kernel.py"


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of the package, with its compiled kernels."""
    folder = tmp_path / "iiwa_sim"
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def told_at_import(checkout: Path) -> tuple[int, str]:
    """Exit code, and what is said on standard error."""
    done = subprocess.run(
        [sys.executable, "-c", f"import iiwa_sim.robot; assert iiwa_sim.__path__ == [{str(checkout)!r}]"],
        cwd=checkout.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stderr


def test_nothing_is_said_of_fresh_kernels(checkout: Path) -> None:
    assert told_at_import(checkout) == (0, "")


def test_an_edited_text_is_told_in_one_line(checkout: Path) -> None:
    with (checkout / KERNEL).open("a") as text:
        text.write("\n")
    code, told = told_at_import(checkout)
    assert code == 1
    assert told.count("\n") == 1
    assert f"{checkout / KERNEL} has been edited since it was compiled" in told
    assert "`make kernels`" in told


@pytest.mark.parametrize(
    ("declaration", "kernels"),
    [
        ("robot/opw_kernel.pxd", {"robot/opw_kernel.py", "robot/inverse_kernel.py"}),
        (
            "motion/shift_kernel.pxd",
            {f"motion/{name}_kernel.py" for name in ("shift", "compliance", "deflected_arm")},
        ),
    ],
)
def test_an_edited_declaration_makes_the_kernels_stale_that_use_it(
    checkout: Path, declaration: str, kernels: set[str]
) -> None:
    before = {text: stamp(text) for text in checkout.rglob("*_kernel.py")}
    with (checkout / declaration).open("a") as declared:
        declared.write("\n")
    stale = {str(text.relative_to(checkout)) for text, was in before.items() if stamp(text) != was}
    assert stale == kernels


def test_a_declaration_of_a_declaration_counts_too(checkout: Path) -> None:
    """The TCP is part of the kinematics, which compliance moves by."""
    text, declared = checkout / "motion/compliance_kernel.py", checkout / "robot/tcp_kernel.pxd"
    before = stamp(text)
    declared.write_text(declared.read_text() + "\n")
    assert stamp(text) != before


def test_an_edited_declaration_is_told_in_one_line(checkout: Path) -> None:
    with (checkout / KERNEL).with_suffix(".pxd").open("a") as declaration:
        declaration.write("\n")
    code, told = told_at_import(checkout)
    assert code == 1
    assert told.count("\n") == 1
    assert "_kernel.py has been edited since it was compiled, or a .pxd" in told


def test_a_kernel_that_is_not_compiled_is_told_in_one_line(checkout: Path) -> None:
    (checkout / KERNEL).with_suffix(EXTENSION_SUFFIXES[0]).unlink()
    code, told = told_at_import(checkout)
    assert code == 1
    assert told.count("\n") == 1
    assert f"{checkout / KERNEL} is not compiled" in told
    assert "`make kernels`" in told


def test_every_kernel_is_in_a_room_that_looks() -> None:
    rooms = {path.parent for path in PACKAGE.glob("*/__init__.py") if "check_kernels(" in path.read_text()}
    for kernel in PACKAGE.rglob("*_kernel.py"):
        assert rooms.intersection(kernel.parents), kernel
