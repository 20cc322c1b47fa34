"""Deletes shared libraries that a server never maps: `python tools/prune_libraries.py`, within an image.

Pinocchio brings all of Boost, and numpy its test modules. Libraries are kept if they are loaded by all
modules of iiwa_sim, by a robot that moves with noise and by a user's own, whose links have meshes. `--check`
loads all of that again and deletes nothing.
"""

import importlib
import pkgutil
import sys
import tempfile
from importlib.resources import files
from pathlib import Path

LACKING = {
    "matplotlib",
    "mcap",
    "mpl_toolkits",
    "pytest",
    "testcontainers",
    "trimesh",
    "viser",
    "zstandard",
    # of ROS 1
    "genpy",
    "rosgraph",
    "rospy",
}
"""Libraries of extras that an image does not have; modules that need them are not loaded."""
MESH = '<geometry><mesh filename="package://nowhere/arm.stl"/></geometry>'


def main() -> None:
    load_all()
    packages = Path(importlib.import_module("numpy").__file__).parent.parent
    if "--check" not in sys.argv[1:]:
        print(f"pruned {delete_unmapped(packages) / 1e6:.0f} MB of libraries that nobody maps")


def load_all() -> None:
    """Import every module, and move robots, one with noise: any of that may load libraries late."""
    iiwa_sim = importlib.import_module("iiwa_sim")
    for module in pkgutil.walk_packages(iiwa_sim.__path__, "iiwa_sim."):
        if module.name == "iiwa_sim.__main__":
            continue
        try:
            importlib.import_module(module.name)
        except ModuleNotFoundError as fault:
            if (fault.name or "").partition(".")[0] not in LACKING:
                raise
    for name in ("numpy.random", "numpy.linalg"):
        importlib.import_module(name)
    noise = importlib.import_module("iiwa_sim.contact.noise")
    noise.Noise(noise.NoiseLevels(1, 1.0, 1.0, 1.0), 7).wrench  # noqa: B018  it is drawn when it is asked for
    simulator = importlib.import_module("iiwa_sim.simulator")
    client = importlib.import_module("iiwa_sim.client")
    options = {"clock": "stepped", "backdoor_http_port": 0, "rosbridge_port": 0}
    with tempfile.TemporaryDirectory() as folder:
        for kind in ({}, {"robot": with_meshes(Path(folder))}):
            with (
                simulator.Simulator(**options, **kind) as robot,
                client.Iiwa(robot.host, robot.port) as driver,
            ):
                driver.joint_move((0.1,) * 7, (0.5,) * 7)
                robot.run_until_stopped()


def with_meshes(folder: Path) -> str:
    """A robot that Pinocchio has to read, unlike those that come along, with a mesh for each of its links."""
    of = files("iiwa_sim.robots") / "lbr_iiwa_7_r800"
    meshes = f"<visual>{MESH}</visual><collision>{MESH}</collision></link>"
    urdf = (of / "robot.urdf").read_text().replace("</link>", meshes)
    (folder / "robot.urdf").write_text(urdf)
    (folder / "robot.toml").write_text((of / "robot.toml").read_text())
    return str(folder)


def delete_unmapped(packages: Path) -> int:
    """Delete libraries below a folder that this process has not mapped, and links to them; returns their
    bytes."""
    maps = [line.split(None, 5) for line in Path("/proc/self/maps").read_text().splitlines()]
    mapped = {Path(words[5]).resolve() for words in maps if len(words) > 5 and words[5].startswith("/")}
    unmapped = [file for file in packages.rglob("*.so*") if file.resolve() not in mapped]
    size = sum(file.lstat().st_size for file in unmapped)
    for file in unmapped:
        file.unlink()
    return size


if __name__ == "__main__":
    main()
