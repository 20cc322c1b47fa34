"""A robot and a viewer of its page."""

from collections.abc import Iterator

import pytest

from iiwa_sim.simulator import Simulator
from tests.view.viewer import Viewer, page_at, place_of, viewing


@pytest.fixture
def simulator() -> Iterator[Simulator]:
    with Simulator(backdoor_port=0) as simulator:
        yield simulator


@pytest.fixture
def viewer(simulator: Simulator) -> Iterator[Viewer]:
    with page_at(place_of(simulator)) as port, viewing(port) as viewer:
        viewer.shows("stopped", "LBR iiwa 7")
        yield viewer
