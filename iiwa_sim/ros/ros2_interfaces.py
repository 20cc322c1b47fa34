"""Compile packages of interfaces that the wheels of ROS 2 lack, by their own generators and a C++ compiler.

The interpreter of an environment with the wheels runs this file. Each argument is a folder `package` with
`msg/*.msg`, `srv/*.srv` and `action/*.action`. The steps are those of https://github.com/ros2/rosidl.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from importlib import import_module
from pathlib import Path

import numpy
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport

PREFIX, PATHS = Path(sys.prefix), sysconfig.get_paths()
ASKED, ON_WIRE = "rosidl_typesupport_c", "rosidl_typesupport_fastrtps_c"
"""The type support that rclpy asks a package for, and the one that it loads."""


def make(source: Path, library: Path, work: Path) -> None:
    """Generate and compile the package in `source`, and install it."""
    package, home, files = source.name, Path(PATHS["purelib"], source.name), list[str]()
    for kind in ("msg", "srv", "action"):
        translate = getattr(import_module(f"rosidl_adapter.{kind}"), f"convert_{kind}_to_idl")
        for each in source.glob(f"{kind}/*.{kind}"):
            translate(source, package, Path(kind, each.name), work / "idl" / kind)
            files.append(f"{work / 'idl'}:{kind}/{each.stem}.idl")
    for name, generator in {
        "c": GenerateC(""),
        "wire": GenerateFastRTPSCTypesupport(""),
        "asked": GenerateCTypesupport("", typesupport_implementations=[ON_WIRE]),
        "python": GeneratePython("", typesupport_implementations=[ASKED]),
    }.items():
        generator.generate(package, files, [str(PREFIX / "share")], work / name / package)
    shutil.copytree(work / "python" / package, home, dirs_exist_ok=True)
    include = PREFIX / "include"
    folders = [include, *include.iterdir(), *work.iterdir(), PATHS["include"], numpy.get_include()]
    command = ["cc", "-shared", "-fPIC", "-O1", "-w", *(f"-I{each}" for each in folders)]
    others = map(str, PREFIX.glob("lib/lib*rosidl*.so"))
    rest = ["-Wl,--as-needed", *others, "-lrcutils", "-lfastcdr", "-lstdc++"]
    rest += [f"-L{PREFIX / 'lib'}", f"-Wl,-rpath,{PREFIX / 'lib'}"]
    sources = {*work.rglob("*.c"), *work.rglob("*.cpp")}
    entries = {each for each in sources if each.name.endswith(f".ep.{ASKED}.c")}
    module = home / f"{package}_s__{ASKED}{sysconfig.get_config_var('EXT_SUFFIX')}"
    made = work / library.name
    subprocess.run([*command, f"-Wl,-soname,{made.name}", "-o", made, *sources - entries, *rest], check=True)
    subprocess.run([*command, "-o", module, *entries, made, *rest], check=True)
    shutil.copy(made, library)


if __name__ == "__main__":
    os.environ["AMENT_PREFIX_PATH"] = str(PREFIX)
    os.dup2(2, 1)  # the generators list their files on standard output
    for each in map(Path, sys.argv[1:]):
        library = PREFIX / "lib" / f"lib{each.name}__{ON_WIRE}.so"
        if not library.exists():
            with tempfile.TemporaryDirectory() as folder:
                make(each.absolute(), library, Path(folder))
