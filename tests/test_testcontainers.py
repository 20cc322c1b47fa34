"""The class for Testcontainers, with a robot of this machine in the place of a container."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any
from unittest import mock

os.environ["TESTCONTAINERS_RYUK_DISABLED"] = (
    "true"  # before the import: it would start a container of its own
)

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.controller.errors import Refused
from iiwa_sim.options.sources import from_environment
from iiwa_sim.simulator import Simulator
from iiwa_sim.testcontainers import BACKDOOR_PORT, KRC4_PORT, PORT, IiwaContainer
from tests.processes import robots


@pytest.fixture(autouse=True)
def docker() -> Iterator[mock.Mock]:
    """In the place of a daemon."""
    with mock.patch("testcontainers.core.container.DockerClient") as client:
        yield client.return_value


def options_of(container: IiwaContainer) -> Any:
    assert from_environment(container.env)[1] == []
    return robots(**container.env | {"IIWA_SIM_HOST": "0.0.0.0"})[""]


def test_its_variables_are_what_the_image_takes() -> None:
    container = IiwaContainer("registry.example/iiwa-sim", clock="fast", strict=True, servo_timeout=1.5)
    options = options_of(container)
    assert container.image == "registry.example/iiwa-sim"
    assert (options.clock, options.strict, options.servo_timeout_s) == ("fast", True, 1.5)
    assert options.port == (PORT,)
    assert (options.backdoor_port, options.backdoor_host) == (BACKDOOR_PORT, "0.0.0.0")
    assert len(options.backdoor_token) == 32
    assert options.backdoor_token != IiwaContainer().env["IIWA_SIM_BACKDOOR_TOKEN"]
    assert set(map(int, container.ports)) == {PORT, KRC4_PORT, BACKDOOR_PORT}


def test_its_driver_and_its_backdoor_reach_the_robot() -> None:
    container = IiwaContainer(clock="stepped")
    token = container.env["IIWA_SIM_BACKDOOR_TOKEN"]
    with Simulator(clock="stepped", backdoor_port=0, backdoor_host="0.0.0.0", backdoor_token=token) as robot:
        published = {PORT: robot.port, BACKDOOR_PORT: robot.backdoor_port}
        with (
            mock.patch.object(IiwaContainer, "get_container_host_ip", return_value="127.0.0.1"),
            mock.patch.object(IiwaContainer, "get_exposed_port", side_effect=published.__getitem__),
            Iiwa(container.host, container.port) as driver,
        ):
            container.backdoor.emergency_stop()
            assert driver.get_error().code == 3030
            assert container.backdoor.run_until_stopped(1) == 0.0
            assert container.state()["error"]["code"] == 3030
            with pytest.raises(Refused, match="the cell has no gripper"):
                container.backdoor.lose_part()
