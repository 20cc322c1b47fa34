"""What pyproject.toml cannot say: the packages under iiwa_sim and two that lie beside it, and the kernels.

A kernel is a file *_kernel.py of iiwa_sim: Python that Cython compiles. Beside the compiled module lies a
stamp with the checksum of what it was made of, by which `iiwa_sim.kernels` knows a stale one.
"""

import runpy
from pathlib import Path

from Cython import __version__ as cython_version
from Cython.Build import cythonize
from setuptools import Extension, find_packages, setup
from setuptools.command.build_ext import build_ext

FLAGS = ["-O3", "-g0", "-ffp-contract=off"]  # the last one for the same bits on any processor of a kind
DIRECTIVES = {
    "boundscheck": False,
    "wraparound": False,
    "initializedcheck": False,
    "cdivision": True,
    "infer_types": True,
}
SHARED = "iiwa_sim.cython_" + cython_version.replace(".", "_")
"""What all kernels need of Cython, compiled once; a kernel finds that of the Cython that made it."""
stamp = runpy.run_path("iiwa_sim/kernels.py")["stamp"]


def in_c(extension: Extension, folder: str) -> Extension:
    """An extension whose C lies in this folder of build/kernels."""
    (found,) = cythonize(
        extension,
        build_dir=f"build/kernels/{folder}",
        compiler_directives=DIRECTIVES,
        language_level=3,
        shared_utility_qualified_name=SHARED,
        quiet=True,
    )
    return found


def kernel(text: Path) -> Extension:
    """The compiled module of a text, by way of C in a folder named after the stamp."""
    extension = Extension(".".join(text.with_suffix("").parts), [str(text)], extra_compile_args=FLAGS)
    return in_c(extension, f"{cython_version}/{stamp(text)}")


class StampedBuild(build_ext):
    """Compiles what has no fresh stamp where it belongs, whatever the times of files say, and stamps it.

    It belongs beside its text for make and for an editable installation, whose folder build_lib is one of
    pip's that is gone afterwards; for a wheel it belongs in build_lib.
    """

    def run(self) -> None:
        self.beside_text = bool(self.inplace)  # setuptools calls all else with inplace off
        super().run()

    def build_extensions(self) -> None:
        kept = self.extensions
        self.extensions = self.made = [extension for extension in kept if not self._is_fresh(extension)]
        self.force = self.parallel = True
        super().build_extensions()
        for extension in self.made:
            Path(self.build_lib, self._stamp_of(extension)).write_text(stamp(_text_of(extension)))
        self.extensions = kept

    def copy_extensions_to_source(self) -> None:
        """For an editable installation, and for make."""
        kept, self.extensions = self.extensions, self.made
        super().copy_extensions_to_source()
        self.extensions = kept
        for extension in self.made:
            self.copy_file(Path(self.build_lib, self._stamp_of(extension)), self._stamp_of(extension))

    def _is_fresh(self, extension: Extension) -> bool:
        folder = "" if self.beside_text else self.build_lib
        compiled = Path(folder, self.get_ext_filename(extension.name))
        stamped = compiled.with_suffix(".stamp")
        fresh = stamped.exists() and stamped.read_text() == stamp(_text_of(extension))
        return fresh and compiled.exists()

    def _stamp_of(self, extension: Extension) -> Path:
        return Path(self.get_ext_filename(extension.name)).with_suffix(".stamp")


def _text_of(extension: Extension) -> Path:
    """A kernel's text; for what the kernels share its C."""
    text = Path(*extension.name.split(".")).with_suffix(".py")
    return text if text.exists() else Path(extension.sources[0])


setup(
    packages=[*find_packages(include=["iiwa_sim", "iiwa_sim.*"]), "iiwa_sim.protocol", "iiwa_sim.robots"],
    ext_modules=[
        in_c(Extension(SHARED, [], extra_compile_args=FLAGS), cython_version),
        *(kernel(text) for text in sorted(Path("iiwa_sim").rglob("*_kernel.py"))),
    ],
    cmdclass={"build_ext": StampedBuild},
)
