"""What many tests start from."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator

import pytest
from hypothesis import settings

from iiwa_sim.simulator import Simulator
from tests import last_results
from tests.talking import Client

settings.register_profile("iiwa-sim", deadline=None)  # no test asks how long something takes
settings.load_profile("iiwa-sim")

collect_ignore = ["examples"]  # a project of its own: test_wheel.py runs it


def pytest_configure(config: pytest.Config) -> None:
    """`make lint` reads how the tests of the requirements went."""
    last_results.register(config)


def pytest_xdist_auto_num_workers() -> int:
    """One more than there are cores: many tests wait for processes of their own."""
    return (os.cpu_count() or 1) + 1


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
