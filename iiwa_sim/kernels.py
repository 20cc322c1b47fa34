"""Checks that the kernels, the compiled inner loops of the core, are there and fit their texts.

A kernel is a file *_kernel.py that is compiled when the package is installed. Without the compiled file
Python would run the text, a hundred times slower; with one of an older text the program would not do what the
text says.
"""

import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from zlib import crc32


def check_kernels(folder: Path) -> None:
    """End the program with one line of advice unless all kernels under a folder are up to date."""
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
    """The contents of the stamp file beside a compiled kernel: the checksum of its text."""
    return str(crc32(text.read_bytes()))
