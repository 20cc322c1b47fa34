"""What pyproject.toml cannot say: the packages under iiwa_sim and two that lie beside it, and the kernels.

A kernel is a file *_kernel.py of iiwa_sim: Python that Cython compiles. Beside the compiled module lies a
stamp with the checksum of the text it was made of, by which `iiwa_sim.kernels` knows a stale one.
"""

import runpy
from pathlib import Path

from Cython.Build import cythonize
from setuptools import Extension, find_packages, setup
from setuptools.command.build_ext import build_ext

FLAGS = ["-O2", "-g0", "-ffp-contract=off"]  # the last one for the same bits on any processor of a kind
DIRECTIVES = {"boundscheck": False, "wraparound": False, "initializedcheck": False, "cdivision": True}
stamp = runpy.run_path("iiwa_sim/kernels.py")["stamp"]


def kernel(text: Path) -> Extension:
    """The compiled module of a text, by way of C in a folder named after the text's checksum."""
    extension = Extension(".".join(text.with_suffix("").parts), [str(text)], extra_compile_args=FLAGS)
    folder = f"build/kernels/{stamp(text)}"
    (in_c,) = cythonize(
        extension, build_dir=folder, compiler_directives=DIRECTIVES, language_level=3, quiet=True
    )
    return in_c


class StampedBuild(build_ext):
    """Compiles what has no stamp of its text, whatever the times of files say, and stamps it."""

    def build_extension(self, ext: Extension) -> None:
        stamped = Path(self.build_lib, self._stamp_of(ext))
        wanted = stamp(Path(*ext.name.split(".")).with_suffix(".py"))
        self.force = not stamped.exists() or stamped.read_text() != wanted
        super().build_extension(ext)
        stamped.write_text(wanted)

    def copy_extensions_to_source(self) -> None:
        """For an editable installation, and for make."""
        super().copy_extensions_to_source()
        for extension in self.extensions:
            self.copy_file(Path(self.build_lib, self._stamp_of(extension)), self._stamp_of(extension))

    def _stamp_of(self, extension: Extension) -> Path:
        return Path(self.get_ext_filename(extension.name)).with_suffix(".stamp")


setup(
    packages=[*find_packages(include=["iiwa_sim", "iiwa_sim.*"]), "iiwa_sim.protocol", "iiwa_sim.robots"],
    ext_modules=[kernel(text) for text in sorted(Path("iiwa_sim").rglob("*_kernel.py"))],
    cmdclass={"build_ext": StampedBuild},
)
