"""The container image as a class of Testcontainers: `pip install 'iiwa-sim[testcontainers]'`, and Docker.

    with IiwaContainer(clock="fast") as robot:
        driver = MyDriver(robot.host, robot.port)
        robot.backdoor.emergency_stop()

Options of `iiwa-sim` are keywords with `_` for `-`; the container gets them as environment variables.
"""

import secrets
from typing import Any

from testcontainers.core.container import DockerContainer
from testcontainers.core.wait_strategies import LogMessageWaitStrategy

from iiwa_sim.backdoor.client import BackdoorClient

IMAGE = "iiwa-sim"
PORT, KRC4_PORT, BACKDOOR_PORT = 30000, 54600, 30080
"""Ports within the container."""
STARTED = "backdoor on "
"""The last line of the start, after which the container listens."""
STARTED_WITHIN_S = 60


class IiwaContainer(DockerContainer):
    """A robot in a container, which listens when the context has been entered.

    Its backdoor is reached over HTTP, with a new token for each container.
    """

    def __init__(self, image: str = IMAGE, **options: str | float | bool) -> None:
        """`options` are those of `iiwa-sim`: `clock="fast"`, `protocol="krc4"`, `strict=True`.

        Raises ValueError for options of addresses and ports, which are set here, and docker's DockerException
        if no Docker runs.
        """
        super().__init__(image)
        self._token = secrets.token_hex(16)
        for name, value in options.items():
            if name in ("host", "port", "count", "fleet") or name.startswith("backdoor"):
                raise ValueError(f"option {name!r}: expected none that says where the container listens")
            text = str(int(value)) if isinstance(value, bool) else str(value)
            self.with_env(f"IIWA_SIM_{name.upper()}", text)
        self._protocols = str(options.get("protocol", "iiwa")).split(",")
        self.with_env("IIWA_SIM_BACKDOOR_PORT", str(BACKDOOR_PORT))
        self.with_env("IIWA_SIM_BACKDOOR_HOST", "0.0.0.0")
        self.with_env("IIWA_SIM_BACKDOOR_TOKEN", self._token)
        self.with_exposed_ports(PORT, KRC4_PORT, BACKDOOR_PORT)
        self.waiting_for(LogMessageWaitStrategy(STARTED).with_startup_timeout(STARTED_WITHIN_S))

    @property
    def host(self) -> str:
        """The address by which this machine reaches the container."""
        return str(self.get_container_host_ip())

    @property
    def port(self) -> int:
        """Port on this machine of the first protocol."""
        return int(self.get_exposed_port(KRC4_PORT if self._protocols[0] == "krc4" else PORT))

    @property
    def backdoor(self) -> BackdoorClient:
        """The backdoor of its robot."""
        return BackdoorClient(self.host, int(self.get_exposed_port(BACKDOOR_PORT)), self._token)

    def state(self) -> dict[str, Any]:
        """The robot's state, as on the status port."""
        return dict(self.backdoor.state())
