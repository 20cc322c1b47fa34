"""setuptools' build backend, which takes a C compiler from PyPI (ziglang) where the system has none."""

import os
import platform
import shutil
import sys

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403

_ZIG = not (os.environ.get("CC") or any(map(shutil.which, ("cc", "gcc", "clang"))))
if _ZIG:
    os.environ["CC"] = f"{sys.executable} -m ziglang cc"
    os.environ["LDSHARED"] = f"{os.environ['CC']} -shared"


def get_requires_for_build_wheel(config_settings=None):
    """Return what the build needs of PyPI; end with one line where a library of ours has no wheel."""
    if sys.platform == "win32":
        sys.exit("iiwa-sim: pin (Pinocchio) has no wheels for Windows: use WSL 2 or the container image")
    on_arm_linux = sys.platform == "linux" and platform.machine() in ("aarch64", "arm64")
    if on_arm_linux and not (os.environ.get("CXX") or any(map(shutil.which, ("c++", "g++", "clang++")))):
        sys.exit("iiwa-sim: ruckig has no wheels for ARM Linux: install a C++ compiler, such as g++")
    return [*build_meta.get_requires_for_build_wheel(config_settings), *(["ziglang"] if _ZIG else [])]


get_requires_for_build_editable = get_requires_for_build_wheel
