"""Checks that the kernels, the compiled inner loops of the core, are there and fit their texts.

A kernel is a file *_kernel.py, Python that is compiled when the package is installed. Where that is missing
Python would run the text instead, a hundred times slower; where the text was edited since, the program would
not do what it says. A kernel is compiled against declarations, *_kernel.pxd: its own, those of kernels it
calls, and what these take from others.

Each process of a user asks this of all kernels: so each file is read once, and paths are text.
"""

import os
import re
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from zlib import crc32

TAKEN_FROM = re.compile(
    rb"^[ \t]*from (?:cython\.cimports\.)?iiwa_sim\.([\w.]+_kernel) c?import ", re.MULTILINE
)
"""A line of a text, or of a declaration, that names another kernel."""

Read = dict[str, tuple[bytes, list[str]]]
"""Files that have been read, by path: what is in each, and the declarations of the kernels that it names.
One that is not there is empty."""


def check_kernels(folder: Path) -> None:
    """End the program with one line of advice unless all kernels under a folder are up to date."""
    there = {f"{within}{os.sep}{name}" for within, _, names in os.walk(folder) for name in names}
    read: Read = {}
    for text in sorted(path for path in there if path.endswith("_kernel.py")):
        compiled = text.removesuffix(".py") + EXTENSION_SUFFIXES[0]
        stamped = compiled.rpartition(".")[0] + ".stamp"
        if {compiled, stamped} <= there and Path(stamped).read_text() == _stamp(text, read):
            continue
        found = "is not compiled"
        if compiled in there:
            found = "has been edited since it was compiled, or a .pxd that it is compiled against,"
        cure = "`make kernels` or, in an environment of your own, `pip install --editable .`"
        sys.exit(f"iiwa-sim: {text} {found} for this Python: {cure} does that")


def stamp(text: Path) -> str:
    """The contents of the stamp file beside a compiled kernel: a checksum of all that it is made of."""
    return _stamp(str(text), {})


def _stamp(text: str, read: Read) -> str:
    """A checksum of all files that Cython reads for a kernel; what is read is kept."""
    unread = [text, text.rpartition(".")[0] + ".pxd"]
    found: set[str] = set()
    while unread:
        path = unread.pop()
        if path not in found:
            found.add(path)
            if path not in read:
                read[path] = _read(path)
            unread += read[path][1]
    checksum = 0
    for path in sorted(found):
        checksum = crc32(read[path][0], checksum)
    return str(checksum)


def _read(path: str) -> tuple[bytes, list[str]]:
    """What is in a file, and the declarations of the kernels that it names."""
    try:
        contents = Path(path).read_bytes()
    except FileNotFoundError:
        return b"", []
    before, package, _ = path.rpartition(f"iiwa_sim{os.sep}")
    names = [name.decode().replace(".", os.sep) for name in TAKEN_FROM.findall(contents)]
    return contents, [f"{before}{package}{name}.pxd" for name in names]
