"""A kernel as Python runs its text: the same functions, not compiled."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import EXTENSION_SUFFIXES, ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType


class _Texts:
    """Finds the texts of kernels for who imports them."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        del target
        if path is None or not name.endswith("_kernel"):
            return None
        text = str(Path(path[0]) / f"{name.rpartition('.')[2]}.py")
        return spec_from_file_location(name, text, loader=SourceFileLoader(name, text))


def interpreted(name: str) -> ModuleType:
    """The text of the kernel of this name, `iiwa_sim.robot.arm_kernel` or so, as a module of its own.

    It uses other kernels interpreted, too; all others who use these go on with the compiled ones.
    """
    compiled = importlib.import_module(name).__file__
    assert compiled is not None
    assert compiled.endswith(tuple(EXTENSION_SUFFIXES)), f"{compiled} is not compiled"
    with _without_compiled_kernels():
        return importlib.import_module(name)


def interpret_all() -> None:
    """From now on this process imports kernels as texts; it has not imported any yet."""
    assert not any(name.endswith("_kernel") for name in sys.modules)
    sys.meta_path.insert(0, _Texts)


@contextmanager
def _without_compiled_kernels() -> Iterator[None]:
    kept = {name: module for name, module in sys.modules.items() if name.endswith("_kernel")}
    for name in kept:
        del sys.modules[name]
    sys.meta_path.insert(0, _Texts)
    try:
        yield
    finally:
        sys.meta_path.remove(_Texts)
        for name in [name for name in sys.modules if name.endswith("_kernel")]:
            del sys.modules[name]
        sys.modules.update(kept)
        for name, module in kept.items():
            room, _, own = name.rpartition(".")
            setattr(sys.modules[room], own, module)
