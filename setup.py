"""Build the kernels, the files *_kernel.py of iiwa_sim: Cython compiles them."""

import os
from pathlib import Path

from Cython import __version__ as cython_version
from Cython.Build import cythonize
from setuptools import Extension, find_packages, setup
from setuptools.command.build_ext import build_ext

FLAGS = ["-O1", "-ftree-vectorize", "-g0", "-ffp-contract=off"]  # the last: same bits on all processors
DIRECTIVES = {
    "boundscheck": False,
    "wraparound": False,
    "initializedcheck": False,
    "cdivision": True,
    "infer_types": True,
}
SHARED = "iiwa_sim.cython_" + cython_version.replace(".", "_")
"""Compiled once, with what all kernels need of Cython."""
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def extension(name: str, *sources: str) -> Extension:
    return Extension(name, list(sources), extra_compile_args=FLAGS, depends=["setup.py"])


class BuildKernels(build_ext):
    """Compile the kernels that are older than their sources, one on each core."""

    def run(self) -> None:
        """Build in one place for all kinds of installation: each finds what is fresh."""
        destination, self.build_lib = self.build_lib, "build/kernels"
        super().run()  # with `inplace` it copies them beside their texts
        if not self.inplace:
            for each in self.extensions:
                name = self.get_ext_filename(each.name)
                target = Path(destination, name)
                self.mkpath(str(target.parent))
                self.copy_file(str(Path(self.build_lib, name)), str(target))
        self.build_lib = destination

    def build_extensions(self) -> None:
        self.parallel = CORES
        in_c = cythonize(
            self.extensions,
            build_dir="build/c",
            nthreads=CORES,
            compiler_directives=DIRECTIVES,
            language_level=3,
            shared_utility_qualified_name=SHARED,
            show_all_warnings=False,
            quiet=True,
        )
        sources = {each.name: each.sources for each in in_c}
        for each in self.extensions:
            each.sources = sources[each.name]
        super().build_extensions()


if __name__ == "__main__":
    texts = sorted(Path("iiwa_sim").rglob("*_kernel.py"))
    setup(
        packages=[*find_packages(include=["iiwa_sim", "iiwa_sim.*"]), "iiwa_sim.protocol", "iiwa_sim.robots"],
        ext_modules=[
            extension(SHARED),
            *(extension(".".join(text.with_suffix("").parts), str(text)) for text in texts),
        ],
        cmdclass={"build_ext": BuildKernels},
    )
