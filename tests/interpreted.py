"""A kernel as Python runs its text: the same functions, not compiled."""

from __future__ import annotations

import importlib
from importlib.machinery import EXTENSION_SUFFIXES, SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType


def interpreted(name: str) -> ModuleType:
    """The text of the kernel of this name, `iiwa_sim.robot.tcp_kernel` or so, as a module of its own.

    Kernels that it uses stay compiled.
    """
    compiled = importlib.import_module(name).__file__
    assert compiled is not None
    assert compiled.endswith(tuple(EXTENSION_SUFFIXES)), f"{compiled} is not compiled"
    text = Path(compiled).with_name(name.rpartition(".")[2] + ".py")
    alone = f"{name}_interpreted"
    spec = spec_from_loader(alone, SourceFileLoader(alone, str(text)))
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
