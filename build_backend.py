"""setuptools' build backend, which takes a C compiler from PyPI (ziglang) where the system has none.

`python build_backend.py` compiles the kernels beside their texts, for `make`; pip does that by its hooks.
"""

import os
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


def get_requires_for_build_wheel(config_settings=None):
    """What is asked of PyPI before the kernels are compiled."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *(["ziglang"] if _ZIG else [])]


get_requires_for_build_editable = get_requires_for_build_wheel


if __name__ == "__main__":
    if _ZIG and find_spec("ziglang") is None:
        subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "ziglang"], check=True)
    subprocess.run([sys.executable, "setup.py", "--quiet", "build_ext", "--inplace"], check=True)
