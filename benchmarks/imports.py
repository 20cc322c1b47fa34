"""What a process computes until it has its first robot, package by package: `python -m benchmarks.imports`.

Prints JSON: ms of computing of the whole, as the pytest plugin does it, and of the imports of each package,
without those of others within them.
"""

import json
import time
from collections import Counter
from importlib.machinery import ExtensionFileLoader, SourceFileLoader
from types import ModuleType
from typing import Any

_spent: Counter[str] = Counter()
_inner_s: list[float] = []


def _timed(loader: type, method: str) -> None:
    """Have a loader's method note what it computes, without what it has others load meanwhile."""
    original = getattr(loader, method)

    def timed(self: Any, loaded: Any) -> Any:
        name: str = loaded.__name__ if isinstance(loaded, ModuleType) else loaded.name
        _inner_s.append(0.0)
        began_s = time.thread_time()
        try:
            return original(self, loaded)
        finally:
            took_s = time.thread_time() - began_s
            _spent[name.partition(".")[0]] += took_s - _inner_s.pop()
            if _inner_s:
                _inner_s[-1] += took_s

    setattr(loader, method, timed)


def main() -> None:
    """Import the simulator, and open and close a robot."""
    _timed(SourceFileLoader, "exec_module")
    _timed(ExtensionFileLoader, "create_module")
    _timed(ExtensionFileLoader, "exec_module")
    began_s = time.process_time()
    from iiwa_sim.simulator import Simulator

    with Simulator(clock="fast", backdoor_port=0):
        pass
    whole_s = time.process_time() - began_s
    packages = {name: 1e3 * spent_s for name, spent_s in _spent.most_common()}
    print(json.dumps({"whole": 1e3 * whole_s, "packages": packages}))


if __name__ == "__main__":
    main()
