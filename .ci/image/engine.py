"""What builds and runs images here: docker or podman, whose command lines are alike."""

import json
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


class EngineFault(Exception):
    """There is none, or it could not do what it was to do. The message is for the screen."""


class NoImagesHere(EngineFault):
    """This machine builds and runs no images, whatever is in them. The message is one line."""


@dataclass
class Engine:
    """A command line, and what it needs on this machine."""

    command: list[str]
    build_options: list[str] = field(default_factory=list)
    run_options: list[str] = field(default_factory=list)

    def __call__(self, *arguments: str, timeout_s: float = 60.0, needed: bool = True) -> str:
        """Run it and give what it printed. With `needed`, raise `EngineFault` where it fails."""
        words = [*self.command, *arguments]
        try:
            done = subprocess.run(words, capture_output=True, text=True, timeout=timeout_s, check=False)
        except subprocess.TimeoutExpired as fault:
            raise EngineFault(f"{' '.join(words)}: nothing after {timeout_s:g} s") from fault
        if needed and done.returncode:
            raise EngineFault(f"{' '.join(words)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout

    def has(self, image: str) -> bool:
        """Whether the image is on this machine."""
        return bool(self("images", "--quiet", image))

    def inspect(self, name: str, kind: str) -> dict[str, Any]:
        """What it knows of an image or a container."""
        (found,) = json.loads(self("inspect", "--type", kind, name))
        return dict(found)

    def size_mb(self, image: str) -> float:
        """Of its files, with those of what it is built on."""
        return float(self.inspect(image, "image")["Size"]) / 1e6

    def build(self, folder: Path, dockerfile: Path, image: str, options: Sequence[str]) -> None:
        """Build with its output on the screen."""
        words = [*self.command, "build", *self.build_options, "--file", str(dockerfile), "--tag", image]
        if subprocess.run([*words, *options, str(folder)], check=False, timeout=1800).returncode:
            raise EngineFault(f"{image} cannot be built")


def check(builder: Engine, base: str, scratch: Path) -> None:
    """Build the least there is on the base, and run it. Raises `NoImagesHere`.

    What goes wrong after that is a fault of what is built.
    """
    nothing, image = scratch / "nothing", "iiwa-sim-nothing"
    nothing.mkdir()
    (nothing / "Dockerfile").write_text(f"FROM {base}\nRUN true\n")
    options = [*builder.build_options, *(["--pull=never"] if builder.command[0] == "podman" else [])]
    try:
        builder("build", *options, "--tag", image, str(nothing), timeout_s=300)
        builder("run", "--rm", "--network", "host", "--read-only", *builder.run_options, image, "true")
    except EngineFault as fault:
        why = str(fault).strip().splitlines()[-1]
        what = f"{builder.command[0]} cannot build and run so much as `true` here"
        raise NoImagesHere(f"{what}: {why}") from None
    finally:
        builder("rmi", "--force", image, needed=False)


def docker() -> Engine | None:
    """None where there is no docker, or none that is running."""
    if shutil.which("docker") is None:
        return None
    answers = subprocess.run(["docker", "info"], capture_output=True, check=False, timeout=60).returncode == 0
    return Engine(["docker"]) if answers else None


def podman(storage: Path | None = None) -> Engine | None:
    """None without podman. With `storage`, images of its own in that folder: the user's stay as they are."""
    if shutil.which("podman") is None:
        return None
    command = ["podman"]
    if not Path("/sys/fs/cgroup/cgroup.controllers").exists() and shutil.which("runc"):
        command += [
            "--runtime",
            "runc",
        ]  # crun, where it is the default, takes no cgroups of version 1 and 2 at once
    if storage is not None:
        command += ["--root", str(storage)]
    # Images of the OCI's format have no health check. Isolation by chroot works inside containers, too.
    build = ["--format", "docker", "--isolation", "chroot"]
    # Podman leaves health checks to systemd, which need not be there; a /tmp that can be written hides what
    # needs one; and its default limits may be higher than it can set.
    run = [
        "--no-healthcheck",
        "--read-only-tmpfs=false",
        "--ulimit",
        "nofile=1024:1024",
        "--ulimit",
        "nproc=1024:1024",
    ]
    return Engine(command, build, run)
