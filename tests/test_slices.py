"""What a thread asks of the system: how soon it runs when it wakes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from iiwa_sim.simulator import Simulator
from iiwa_sim.slices import SLICE_NS, run_soon

_ASKS = """
import os, sys
from iiwa_sim.slices import run_soon
os.sched_setscheduler(0, int(sys.argv[1]), os.sched_param(0))
nice = os.nice(1)
run_soon()
child = os.fork()
if child:
    os.waitpid(child, 0)
print(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, os.nice(0) - nice, flush=True)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux knows slices")
@pytest.mark.parametrize("policy", ["SCHED_OTHER", "SCHED_BATCH"])  # SCHED_IDLE may never run
def test_policy_and_nice_value_stay_as_they_are_for_children_too(policy: str) -> None:
    number = getattr(os, policy)
    done = subprocess.run(
        [sys.executable, "-c", _ASKS, f"{number}"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"{number} 0\n" * 2


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux knows slices")
def test_the_thread_of_a_simulator_has_short_slices_and_no_other_has() -> None:
    def slices() -> list[str]:
        lines = Path("/proc/thread-self/sched").read_text().splitlines()
        return [line.split()[-1] for line in lines if line.startswith("se.slice")]

    try:
        before = slices()
    except OSError:
        before = []
    if not before:
        pytest.skip("this Linux does not tell its slices")
    with Simulator() as simulator:
        there = simulator.call(slices)
        assert there == ([f"{SLICE_NS}"] if simulator.call(run_soon) else before)
    assert slices() == before


def test_a_system_that_does_not_know_slices_is_no_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr("platform.machine", lambda: "pdp11")
        assert run_soon() is False
    monkeypatch.setattr("sys.platform", "darwin")
    assert run_soon() is False
