"""`make image` where there is little to build with: programs that stand in for podman and debootstrap."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.processes import ended

IMAGE = Path(__file__).parent.parent.parent / ".ci" / "image"
NO_IMAGES_HERE = 75

PODMAN = """\
#!/bin/sh
case "$*" in
  *--version*) echo podman version 4.3.1 ;;
  *"build "*nothing*) {least} ;;
  *"build "*) echo our Dockerfile is wrong >&2; exit 9 ;;
  *"run "*) {runs} ;;
  *pull*) {pulls} ;;
  *images*) {has} ;;
esac
"""


def image(folder: Path, **programs: str) -> subprocess.CompletedProcess[str]:
    """How it ends where there are these programs, by their texts, and Python's."""
    for name, text in programs.items():
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    for name in ("sh", "git", "python3"):
        found = shutil.which(name)
        assert found is not None
        (folder / name).symlink_to(found)
    return ended([sys.executable, str(IMAGE)], env={"PATH": str(folder), "HOME": str(folder)})


def podman(least: str = "true", runs: str = "true", pulls: str = "true", has: str = "true") -> str:
    return PODMAN.format(least=least, runs=runs, pulls=pulls, has=has)


@pytest.mark.parametrize(
    ("programs", "reason"),
    [
        ({}, "there is no docker that runs, and no podman"),
        ({"podman": podman(pulls="exit 125")}, "there is no debootstrap to make a base with"),
        (
            {
                "podman": podman(pulls="exit 125"),
                "debootstrap": "#!/bin/sh\necho E: Cannot install into target mounted with noexec; exit 1\n",
            },
            "debootstrap makes no base here: E: Cannot install into target mounted with noexec",
        ),
        (
            {"podman": podman(least="echo 'error building: no chroot' >&2; exit 125")},
            "podman cannot build and run so much as `true` here: error building: no chroot",
        ),
        (
            {"podman": podman(runs="echo 'runc: operation not permitted' >&2; exit 126")},
            "podman cannot build and run so much as `true` here: runc: operation not permitted",
        ),
    ],
)
def test_a_machine_without_images_says_so_in_one_line(
    tmp_path: Path, programs: dict[str, str], reason: str
) -> None:
    done = image(tmp_path, **programs)
    assert done.returncode == NO_IMAGES_HERE, done.stderr
    assert done.stderr.startswith("image: no images can be built and run here: ")
    assert reason in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_fault_of_our_image_is_one(tmp_path: Path) -> None:
    done = image(tmp_path, podman=podman())
    assert done.returncode == 1
    assert "our Dockerfile is wrong" in done.stderr
    assert "iiwa-sim cannot be built" in done.stderr
