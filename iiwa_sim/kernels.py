"""Kernels: whether the inner loops of the core are compiled, and from the texts that lie beside them.

A kernel is a file *_kernel.py, Python that is compiled when the package is installed. Where that is missing
Python would run the text instead, a hundred times slower; where the text was edited since, the program would
not do what it says.
"""

import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from zlib import crc32


def check_kernels(folder: Path) -> None:
    """End the program with one line that says what to do, unless all kernels under a folder are fresh."""
    for text in sorted(folder.rglob("*_kernel.py")):
        compiled = text.with_suffix(EXTENSION_SUFFIXES[0])
        try:
            fresh = compiled.with_suffix(".stamp").read_text() == stamp(text)
        except FileNotFoundError:
            fresh = False
        if not (fresh and compiled.exists()):
            found = "has been edited since it was compiled" if compiled.exists() else "is not compiled"
            cure = "`make kernels` or, in an environment of your own, `pip install --editable .`"
            sys.exit(f"iiwa-sim: {text} {found} for this Python: {cure} does that")


def stamp(text: Path) -> str:
    """What stands beside a compiled kernel: the checksum of its text."""
    return str(crc32(text.read_bytes()))
