"""`import iiwa_sim`: what it offers, where that comes from, and what it costs to ask for it."""

from __future__ import annotations

import subprocess
import sys

HEAVY = ("numpy", "pinocchio", "ruckig", "matplotlib", "iiwa_sim.simulator", "iiwa_sim.controller")
OWN = "iiwa_sim"


def loaded_by(text: str) -> set[str]:
    """The modules of a fresh process that has carried out this."""
    told = subprocess.run(
        [sys.executable, "-c", f"{text}\nimport sys\nprint(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(told.stdout.split())


def test_importing_it_loads_nothing_else_of_ours_and_no_library() -> None:
    loaded = loaded_by("import iiwa_sim")
    assert {name for name in loaded if name.partition(".")[0] == OWN} == {OWN}
    assert not loaded & {*HEAVY, "msgspec", "asyncio"}
