"""Puts a library that only refuses in place of one of which a server calls nothing, within an image: `python
tools/stand_in.py libassimp.so Assimp`, with the namespace of its functions.

Pinocchio's collisions (coal) are linked to Assimp, which reads meshes. A server reads none; but the loader
wants each library that another one names, with all functions that are called there. The stand-in has those
of the namespace, and each raises a `RuntimeError` that says so. What a library hands on from the compiler's
runtime is left out: others have it, too, or nothing loads, which `prune_libraries.py --check` finds.
"""

import importlib
import subprocess
import sys
from pathlib import Path

FUNCTIONS = "TW"
"""Letters by which nm tells functions."""


def main() -> None:
    packages = Path(importlib.import_module("numpy").__file__).parent.parent
    name, namespace = sys.argv[1:]
    print(put_in_place(packages, name, namespace))


def put_in_place(packages: Path, name: str, namespace: str) -> str:
    """Replace the library of this file name below a folder; returns what became of it."""
    found = {file.resolve() for file in packages.rglob(name)}
    if not found:
        return f"{name} is not there"
    (library,) = found
    (soname,) = _dynamic(library, "SONAME")
    others = (file for file in packages.rglob("*.so*") if not file.is_symlink() and file != library)
    users = [file for file in others if soname in _dynamic(file, "NEEDED")]
    has = _symbols(library, "--defined-only")
    used = {symbol for user in users for symbol in _symbols(user, "--undefined-only")} & has.keys()
    of_it = sorted(symbol for symbol in used if f"{len(namespace)}{namespace}" in symbol)
    data = [symbol for symbol in of_it if has[symbol] not in FUNCTIONS]
    if data:
        return f"{name} stays: others use its data, such as {data[0]}"
    size = library.stat().st_size
    library.unlink()
    words = ["c++", "-shared", "-fPIC", "-s", f"-Wl,-soname,{soname}", "-o", str(library), "-x", "c++", "-"]
    subprocess.run(words, input=_text(name, of_it), text=True, check=True)
    return f"{name}: {size / 1e6:.1f} MB less, and {len(of_it)} functions that refuse"


def _text(name: str, symbols: list[str]) -> str:
    """C++ text: functions that have these names in the object file."""
    says = f'throw std::runtime_error("{name} is not in this image, where nothing of it is needed");'
    functions = (
        f'extern "C" void f{number}() __asm__("{symbol}");\nvoid f{number}() {{ {says} }}\n'
        for number, symbol in enumerate(symbols)
    )
    return "#include <stdexcept>\n" + "".join(functions)


def _dynamic(library: Path, key: str) -> list[str]:
    """Names in the dynamic section under a key, such as NEEDED."""
    lines = _told("readelf", "--dynamic", "--wide", str(library)).splitlines()
    return [line.partition("[")[2].rpartition("]")[0] for line in lines if f"({key})" in line]


def _symbols(library: Path, which: str) -> dict[str, str]:
    """Dynamic symbols without their versions, with the letter of what each one is."""
    lines = _told("nm", "--dynamic", "--format=posix", which, str(library)).splitlines()
    return {line.split()[0].partition("@")[0]: line.split()[1] for line in lines}


def _told(*words: str) -> str:
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    main()
