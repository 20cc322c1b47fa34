"""setuptools' build backend, which takes a C compiler from PyPI (ziglang) where the system has none.

`python build_backend.py` compiles the kernels beside their texts, for `make`; pip does that by its hooks.
"""

import os
import platform
import shutil
import subprocess
import sys
from importlib.util import find_spec

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403

# Before setup.py runs, which looks for a compiler.
_ZIG = not (os.environ.get("CC") or any(map(shutil.which, ("cc", "gcc", "clang"))))
if _ZIG:
    os.environ["CC"] = f"{sys.executable} -m ziglang cc"
    os.environ["LDSHARED"] = f"{os.environ['CC']} -shared"


def _check_platform():
    """End with one line where a library that we need has no wheels, before a compiler's page tells it."""
    if sys.platform == "win32":
        sys.exit("iiwa-sim: pin (Pinocchio) has no wheels for Windows: take WSL 2 or the container image")
    on_arm_linux = sys.platform == "linux" and platform.machine() in ("aarch64", "arm64")
    if on_arm_linux and not (os.environ.get("CXX") or any(map(shutil.which, ("c++", "g++", "clang++")))):
        sys.exit(
            "iiwa-sim: ruckig has no wheels for ARM Linux, so pip compiles it, which takes a C++ compiler: "
            "apt install g++, or what your system calls it"
        )


def get_requires_for_build_wheel(config_settings=None):
    """What is asked of PyPI before the kernels are compiled."""
    _check_platform()
    return [*build_meta.get_requires_for_build_wheel(config_settings), *(["ziglang"] if _ZIG else [])]


get_requires_for_build_editable = get_requires_for_build_wheel


if __name__ == "__main__":
    if _ZIG and find_spec("ziglang") is None:
        subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "ziglang"], check=True)
    subprocess.run([sys.executable, "setup.py", "--quiet", "build_ext", "--inplace"], check=True)
