"""Makes packages of interfaces that the wheels of ROS 2 lack, by their own generators and a C++ compiler.

It is run by the interpreter of an environment that has the wheels. Each argument is a folder `package` with
`msg/*.msg`, `srv/*.srv` and `action/*.action`. rclpy loads compiled type support for each package. The steps
are those of the CMake functions of rosidl: https://github.com/ros2/rosidl.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from importlib import import_module
from pathlib import Path

PREFIX = Path(sys.prefix)
SHARE = PREFIX / "share"
TYPESUPPORT = "rosidl_typesupport_c"
"""The typesupport that rclpy asks a package for, and the name of a generator; it loads the one below."""
ON_WIRE = "rosidl_typesupport_fastrtps_c"
HASHING = "rosidl_generator_c"
"""The generator that also describes the types, in JSON."""
PYTHON = "rosidl_generator_py"


def make(source: Path, work: Path) -> None:
    """Make one package, of the definitions in `source`, in the empty folder `work`; install it."""
    package = source.name
    idl, interfaces = work / "idl" / package, list[str]()
    for kind in ("msg", "srv", "action"):
        translate = getattr(import_module(f"rosidl_adapter.{kind}"), f"convert_{kind}_to_idl")
        for each in sorted((source / kind).glob(f"*.{kind}")):
            translate(source, package, Path(kind, each.name), idl / kind)
            interfaces.append(f"{idl}:{kind}/{each.stem}.idl")
    generate(package, interfaces, work)
    install(package, work, *compiled(package, work))


def generate(package: str, interfaces: list[str], work: Path) -> None:
    """Have each generator write into `work / GENERATOR / PACKAGE`: of some, files have the same names."""

    def run(generator: str, extension: str, **options: list[str]) -> None:
        made = getattr(import_module(f"{generator}.cli"), extension)(generator, **options)
        made.generate(package, interfaces, [str(SHARE)], work / generator / package)

    run(HASHING, "GenerateC")
    run(ON_WIRE, "GenerateFastRTPSCTypesupport")
    run(TYPESUPPORT, "GenerateCTypesupport", typesupport_implementations=[ON_WIRE])
    run(PYTHON, "GeneratePython", typesupport_implementations=[TYPESUPPORT])


def compiled(package: str, work: Path) -> tuple[Path, Path]:
    """The package's library, with all that was generated but Python's entry, and the module with that."""
    include = PREFIX / "include"
    folders = [include, *include.iterdir(), *work.iterdir(), sysconfig.get_paths()["include"]]
    folders.append(import_module("numpy").get_include())
    command = ["cc", "-shared", "-fPIC", "-O1", "-w", *(f"-I{each}" for each in folders)]
    sources = [each for suffix in ("c", "cpp") for each in sorted(work.rglob(f"*.{suffix}"))]
    (entry,) = (each for each in sources if each.name.endswith(f".ep.{TYPESUPPORT}.c"))
    sources.remove(entry)
    library = work / f"lib{package}__{ON_WIRE}.so"
    module = work / f"{package}_s__{TYPESUPPORT}{sysconfig.get_config_var('EXT_SUFFIX')}"
    libraries = PREFIX / "lib"
    others = [str(each) for each in sorted(libraries.glob("lib*rosidl*.so")) if package not in each.name]
    rest = ["-Wl,--as-needed", *others, "-lrcutils", "-lfastcdr", "-lstdc++"]
    rest += [f"-L{libraries}", f"-Wl,-rpath,{libraries}"]
    call([*command, f"-Wl,-soname,{library.name}", "-o", library, *sources, *rest])
    call([*command, "-o", module, entry, library, *rest])
    return library, module


def call(command: list[str | Path]) -> None:
    """Run a compiler; ends the program with what it says, where it fails."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{command[0]} has failed:\n{done.stderr}")


def install(package: str, work: Path, library: Path, module: Path) -> None:
    """Put the package where it is imported from, and its descriptions where other packages look."""
    shutil.copy(library, PREFIX / "lib")
    home = Path(sysconfig.get_paths()["purelib"]) / package
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir()
    (home / "__init__.py").touch()
    shutil.copy(module, home)
    for each in (work / PYTHON / package).glob("*/*.py"):
        (home / each.parent.name).mkdir(exist_ok=True)
        shutil.copy(each, home / each.parent.name)
    for each in (*(work / "idl" / package).glob("*/*.idl"), *(work / HASHING / package).glob("*/*.json")):
        (SHARE / package / each.parent.name).mkdir(parents=True, exist_ok=True)
        shutil.copy(each, SHARE / package / each.parent.name)


def main() -> None:
    os.environ["AMENT_PREFIX_PATH"] = str(PREFIX)
    os.dup2(2, 1)  # the generators tell on standard output what they read
    for each in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as folder:
            make(Path(each).absolute(), Path(folder))


if __name__ == "__main__":
    main()
