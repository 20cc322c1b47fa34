"""Fixtures and profiles shared by many tests."""

from __future__ import annotations

import atexit
import gc
import logging
import os
from collections.abc import AsyncIterator, Iterator

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from hypothesis.internal.constants_ast import Constants

from iiwa_sim.simulator import Simulator
from tests.line_client import Client

# No test asks how long something takes. Samples are the same in every run: few in `make test`, many with
# HYPOTHESIS_PROFILE=many. HYPOTHESIS_PROFILE=hunt draws new ones.
for profile, samples in (("few", 4), ("many", 60), ("hunt", 100)):
    settings.register_profile(
        profile,
        max_examples=samples,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow],
        derandomize=profile != "hunt",
        database=None,
    )
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "few"))
# Else samples would hang on the numbers in the sources, and on what a worker happened to import before.
providers._get_local_constants = Constants  # type: ignore[assignment]

# Collected objects stay: the garbage collector need not search them in each test or at pytest's end.
gc.disable()
atexit.register(gc.unfreeze)  # what a library finds at the end of the process it would call leaked

collect_ignore = ["examples"]  # a project of its own: test_examples.py runs it


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)  # tests make many objects, and few cycles
    gc.enable()


def pytest_xdist_auto_num_workers() -> int:
    """Two more than there are cores: many tests wait for processes of their own, or for real time."""
    return (os.cpu_count() or 1) + 2


@pytest.fixture(autouse=True)
def _level_of_the_log() -> Iterator[None]:
    """A test that runs the program within its own process leaves the log as it was."""
    level = logging.getLogger("iiwa_sim").level
    yield
    logging.getLogger("iiwa_sim").setLevel(level)


@pytest.fixture
async def simulator() -> AsyncIterator[Simulator]:
    """A simulator that listens, inside the test's own loop."""
    async with Simulator() as simulator:
        yield simulator


@pytest.fixture
async def client(simulator: Simulator) -> AsyncIterator[Client]:
    """A driver connected to it."""
    client = await Client.connect(simulator.port)
    yield client
    await client.leaves()
