"""Checks that the kernels, the compiled inner loops of the core, are there and fit their texts.

A kernel is a file *_kernel.py, Python that is compiled when the package is installed. Where that is missing
Python would run the text instead, a hundred times slower; where the text was edited since, the program would
not do what it says. A kernel is compiled against declarations, *_kernel.pxd: its own, those of kernels it
calls, and what these take from others.
"""

import re
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from zlib import crc32

TAKEN_FROM = re.compile(r"^\s*from (?:cython\.cimports\.)?iiwa_sim\.([\w.]+_kernel) c?import ", re.MULTILINE)
"""A line of a text, or of a declaration, that names another kernel."""


def check_kernels(folder: Path) -> None:
    """End the program with one line of advice unless all kernels under a folder are up to date."""
    for text in sorted(folder.rglob("*_kernel.py")):
        compiled = text.with_suffix(EXTENSION_SUFFIXES[0])
        try:
            fresh = compiled.with_suffix(".stamp").read_text() == stamp(text)
        except FileNotFoundError:
            fresh = False
        if not (fresh and compiled.exists()):
            found = "is not compiled"
            if compiled.exists():
                found = "has been edited since it was compiled, or a .pxd that it is compiled against,"
            cure = "`make kernels` or, in an environment of your own, `pip install --editable .`"
            sys.exit(f"iiwa-sim: {text} {found} for this Python: {cure} does that")


def stamp(text: Path) -> str:
    """The contents of the stamp file beside a compiled kernel: a checksum of all that it is made of."""
    checksum = 0
    for read in sorted(_read_for(text)):
        checksum = crc32(read.read_bytes(), checksum)
    return str(checksum)


def _read_for(text: Path) -> set[Path]:
    """The files that Cython reads for a kernel."""
    package = next((folder for folder in text.parents if folder.name == "iiwa_sim"), text.parent)
    found: set[Path] = set()
    unread = [text, text.with_suffix(".pxd")]
    while unread:
        read = unread.pop()
        if read.exists() and read not in found:
            found.add(read)
            names = TAKEN_FROM.findall(read.read_text(encoding="utf-8"))
            unread += [package.joinpath(*name.split(".")).with_suffix(".pxd") for name in names]
    return found
