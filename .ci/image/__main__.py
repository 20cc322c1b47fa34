"""`make image`: build all images and try them; exit code 1 with what is wrong.

Exit code 75, with the reason in one line, where this machine can build and run no images at all: neither
docker nor podman runs so much as `true`, or there is no base to build on. make makes a 2 of either.

By docker, or by podman. Where podman reaches no registry of images, it builds on a base made from Debian's
packages, with images of its own under ~/.cache/iiwa-sim: they last, so that a second build takes seconds.
"""

import os
import platform
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import base
import documented
import engine
import trial
from engine import Engine, EngineFault, NoImagesHere

SOURCE = Path(__file__).parent.parent.parent
DOCKERFILE = SOURCE / "Dockerfile"
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "iiwa-sim" / "images"
NO_IMAGES_HERE = os.EX_TEMPFAIL  # 75
IMAGES = {
    "iiwa-sim": [],
    "iiwa-sim-view": ["--target", "view"],
    "iiwa-sim-ros": ["--target", "ros"],
    "iiwa-sim-ros2": ["--target", "ros2"],
}
if platform.machine() != "x86_64":  # there are no wheels of rclpy
    del IMAGES["iiwa-sim-ros2"]


def main() -> None:
    with tempfile.TemporaryDirectory(prefix="iiwa-sim-image-") as folder:
        scratch = Path(folder)
        builder, options = _builder(scratch)
        engine.check(builder, _base(), scratch)
        dockerfile = _understood_by(builder, scratch)
        for image, target in IMAGES.items():
            builder.build(SOURCE, dockerfile, image, [*options, *_labels(), *target])
        base_mb = builder.size_mb(_base())
        print(f"base: {base_mb:.0f} MB", flush=True)
        trial.try_image(builder, "iiwa-sim", base_mb=base_mb)
        documented.try_documented(builder)
        trial.try_page(builder, "iiwa-sim-view")
        if "iiwa-sim-ros2" in IMAGES:
            trial.try_ros2(builder, "iiwa-sim-ros2")
        master = f"http://127.0.0.1:{(port := trial.free_port())}"
        with trial.running(
            builder, "iiwa-sim-ros", "--entrypoint", "rosmaster", then=("--core", "-p", str(port))
        ) as ros:
            ros.answer(port, b"GET / HTTP/1.0\r\n\r\n")
            node = ["--env", f"ROS_MASTER_URI={master}", "--env", "ROS_IP=127.0.0.1"]
            trial.try_image(builder, "iiwa-sim-ros", *node)


def _builder(scratch: Path) -> tuple[Engine, list[str]]:
    """What builds here, with options for a build; the base is there, or can be pulled."""
    name = _base()
    for builder in (engine.docker(), engine.podman()):
        if builder is not None and (builder.has(name) or _pulls(builder, name)):
            return builder, []
    builder = engine.podman(CACHE)
    if builder is None:
        raise NoImagesHere("there is no docker that runs, and no podman")
    if not builder.has(name):
        print(f"{name} cannot be pulled here: a base from Debian's packages takes its place", flush=True)
        base.make(builder, name)
    return builder, ["--pull=never", *base.settings(scratch)]


def _base() -> str:
    found = re.search(r"^ARG BASE=(\S+)$", DOCKERFILE.read_text(), re.MULTILINE)
    assert found
    return found[1]


def _pulls(builder: Engine, name: str) -> bool:
    try:
        builder("pull", name, timeout_s=300)
    except EngineFault:
        return False
    return True


def _understood_by(builder: Engine, scratch: Path) -> Path:
    """Our Dockerfile; for a podman before 4.9 without --start-interval, which it does not know."""
    version = re.search(r"podman version (\d+)\.(\d+)", builder("--version"))
    if version is None or (int(version[1]), int(version[2])) >= (4, 9):
        return DOCKERFILE
    print("this podman does not know --start-interval of HEALTHCHECK: built without it", flush=True)
    copy = scratch / "Dockerfile"
    copy.write_text(DOCKERFILE.read_text().replace(" --start-interval=1s", ""))
    return copy


def _labels() -> list[str]:
    tag = _git("describe", "--tags", "--exact-match", "--match=v*")  # none where this is no release
    return ["--build-arg", f"VERSION={tag}", "--build-arg", f"REVISION={_git('rev-parse', 'HEAD')}"]


def _git(*words: str) -> str:
    """What git prints of the source; nothing where it cannot."""
    command = ["git", "-C", str(SOURCE), *words]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


if __name__ == "__main__":
    try:
        main()
    except NoImagesHere as fault:
        print(f"image: no images can be built and run here: {fault}", file=sys.stderr)
        sys.exit(NO_IMAGES_HERE)
    except EngineFault as fault:
        sys.exit(f"image: {fault}")
