"""Makes packages of interfaces that the wheels of ROS 2 lack, by their own generators and a C++ compiler.

It is run by the interpreter of an environment that has the wheels. Each argument is a folder `package` with
`msg/*.msg`, `srv/*.srv` and `action/*.action`. rclpy loads compiled type support for each package. The steps
are those of the CMake functions of rosidl: https://github.com/ros2/rosidl.
"""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

PREFIX = Path(sys.prefix)
SHARE = PREFIX / "share"
TYPESUPPORT = "rosidl_typesupport_c"
"""The typesupport that rclpy asks a package for, and the name of a generator; it loads the one below."""
ON_WIRE = "rosidl_typesupport_fastrtps_c"
HASHES = "rosidl_generator_type_description"
PYTHON = "rosidl_generator_py"
KINDS = ("msg", "srv", "action")


def make(source: Path, work: Path) -> None:
    """Make one package, of the definitions in `source`, in the empty folder `work`; install it."""
    package = source.name
    named = [(kind, each.stem) for kind in KINDS for each in sorted((source / kind).glob(f"*.{kind}"))]
    for kind, name in named:
        translate = getattr(import_module(f"rosidl_adapter.{kind}"), f"convert_{kind}_to_idl")
        translate(source, package, Path(kind, f"{name}.{kind}"), work / "idl" / package / kind)
    generate(source, work, named)
    install(package, work, *compiled(package, work))


def generate(source: Path, work: Path, named: list[tuple[str, str]]) -> None:
    """Have each generator write into `work / GENERATOR / PACKAGE`: of some, files have the same names."""
    package = source.name
    idl, described = work / "idl" / package, work / HASHES / package
    others = [each for each in SHARE.iterdir() if each.is_dir()]
    told: dict[str, Any] = {
        "package_name": package,
        "idl_tuples": [f"{idl}:{kind}/{name}.idl" for kind, name in named],
        "ros_interface_dependencies": [
            f"{each.name}:{idl}" for each in others for kind in KINDS for idl in each.glob(f"{kind}/*.idl")
        ],
        "target_dependencies": [],
        "include_paths": [f"{each.name}:{each}" for each in others],
        "type_description_tuples": [
            f"{kind}/{name}.idl:{described}/{kind}/{name}.json" for kind, name in named
        ],
        "ros_interface_files": [f"{source}/{kind}/{name}.{kind}" for kind, name in named],
    }

    def run(generator: str, function: str, *more: list[str]) -> None:
        templates, out = SHARE / generator / "resource", work / generator / package
        (out / "msg").mkdir(parents=True)
        told.update(template_dir=str(templates), output_dir=str(out))
        path = work / f"{generator}.json"
        path.write_text(json.dumps(told), encoding="utf-8")
        getattr(import_module(generator), function)(str(path), *more)
        header = f"{generator}__visibility_control.h"
        if (templates / f"{header}.in").exists():
            text = (templates / f"{header}.in").read_text(encoding="utf-8")
            text = text.replace("@PROJECT_NAME_UPPER@", package.upper()).replace("@PROJECT_NAME@", package)
            (out / "msg" / header).write_text(text, encoding="utf-8")

    run(HASHES, "generate_type_hash")
    run("rosidl_generator_c", "generate_c")
    run(ON_WIRE, "generate_typesupport_fastrtps_c")
    run(TYPESUPPORT, "generate_c", [ON_WIRE])
    run(PYTHON, "generate_py", [TYPESUPPORT])


def compiled(package: str, work: Path) -> tuple[Path, Path]:
    """The package's library, with all that was generated but Python's entry, and the module with that."""
    generated = sorted(work.glob(f"*/{package}"))
    arrays = import_module("numpy").get_include()
    folders = [*(each.parent for each in generated), Path(sysconfig.get_paths()["include"]), Path(arrays)]
    folders += [PREFIX / "include", *(each for each in (PREFIX / "include").iterdir() if each.is_dir())]
    includes = [f"-I{each}" for each in folders]
    for out in generated:
        for compiler, suffix, standard in (("cc", "c", "gnu11"), ("c++", "cpp", "c++17")):
            sources = sorted(str(each) for each in out.rglob(f"*.{suffix}"))
            if sources:
                options = [f"-std={standard}", "-O1", "-fPIC", "-w", *includes]
                call([compiler, *options, "-c", *sources], out)
    library = work / f"lib{package}__{ON_WIRE}.so"
    module = work / f"{package}_s__{TYPESUPPORT}{sysconfig.get_config_var('EXT_SUFFIX')}"
    (entry,) = work.glob(f"*/*/*.ep.{TYPESUPPORT}.o")
    parts = sorted(str(each) for out in generated for each in out.glob("*.o") if each != entry)
    others = sorted(str(each) for each in (PREFIX / "lib").glob("lib*rosidl*.so") if package not in each.name)
    others += [str(PREFIX / "lib" / f"lib{name}.so") for name in ("rcutils", "fastcdr")]
    rest = ["-Wl,--as-needed", *others, f"-Wl,-rpath,{PREFIX / 'lib'}"]
    call(["c++", "-shared", f"-Wl,-soname,{library.name}", "-o", str(library), *parts, *rest], work)
    call(["c++", "-shared", "-o", str(module), str(entry), str(library), *rest], work)
    return library, module


def call(arguments: list[str], folder: Path) -> None:
    """Run a compiler; ends the program with what it says, where it fails."""
    done = subprocess.run(arguments, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{arguments[0]} has failed:\n{done.stderr}")


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
    for each in (*(work / "idl" / package).glob("*/*.idl"), *(work / HASHES / package).glob("*/*.json")):
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
