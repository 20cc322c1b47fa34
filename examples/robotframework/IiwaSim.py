"""Keywords of Robot Framework for a simulated robot: a library in one file, beside the suite that uses it.

    *** Settings ***
    Library    IiwaSim.py    clock=fast

Each suite has a robot of its own, which starts with the first keyword and ends with the suite.
"""

from pathlib import Path
from typing import Any

from robot.api.deco import keyword, library

from iiwa_sim.client import CommandError, Iiwa
from iiwa_sim.simulator import Simulator


@library(scope="SUITE", auto_keywords=False, doc_format="TEXT")
class IiwaSim:
    """An LBR iiwa with its controller, simulated. Positions in mm and rad, speeds relative, up to 1."""

    ROBOT_LISTENER_API_VERSION = 3

    def __init__(self, robot: str = "lbr_iiwa_7_r800", cell: Path | None = None, clock: str = "fast") -> None:
        """`cell` is the path of a cell.toml, which then names the robot."""
        self.ROBOT_LIBRARY_LISTENER = self
        self._options: dict[str, Any] = {"clock": clock, **({"cell": cell} if cell else {"robot": robot})}
        self._running: tuple[Simulator, Iiwa] | None = None

    def end_suite(self, *_: object) -> None:
        """The suite is over: the robot is, too."""
        if self._running is not None:
            simulator, robot = self._running
            self._running = None
            robot.close()
            simulator.__exit__(None, None, None)

    @keyword("Robot Address")
    def address(self) -> str:
        """HOST:PORT, where the driver under test connects."""
        return f"{self._simulator.host}:{self._simulator.port}"

    @keyword("Joint Move")
    def joint_move(self, speed_rel: float, *joints_rad: float) -> None:
        """All joints together; fails where the robot refuses it, with its reason."""
        self._does(lambda robot: robot.joint_move(joints_rad, [speed_rel] * len(joints_rad)))

    @keyword("Lin Move")
    def lin_move(
        self, x: float, y: float, z: float, alpha: float, beta: float, gamma: float, speed: float = 0.5
    ) -> None:
        """The TCP on a straight line; fails where the robot refuses it, with its reason."""
        self._does(lambda robot: robot.lin_move((x, y, z, alpha, beta, gamma), speed, 0.0))

    @keyword("Wait Until Stopped")
    def wait_until_stopped(self, timeout_s: float = 60.0) -> None:
        """Until no move runs or waits."""
        self._robot.wait_until_stopped(timeout_s=timeout_s)

    @keyword("Tool Should Be At")
    def tool_should_be_at(self, x: float, y: float, z: float, within_mm: float = 0.01) -> None:
        """Fails where the TCP is elsewhere."""
        found = self._robot.get_tool_frame()[:3]
        if any(abs(a - b) > within_mm for a, b in zip(found, (x, y, z), strict=True)):
            raise AssertionError(f"the TCP is at {found} mm, expected {(x, y, z)}")

    @keyword("Press Emergency Stop")
    def press_emergency_stop(self) -> None:
        """As somebody beside the robot would."""
        self._simulator.backdoor.emergency_stop()

    @keyword("Restore Robot")
    def restore(self) -> None:
        """At rest: as it was in the beginning, without errors."""
        self._simulator.backdoor.restore_state("start")

    @keyword("Error Code Should Be")
    def error_code_should_be(self, code: int) -> None:
        """Fails where `get error` tells another code; 0 is none."""
        found = self._robot.get_error()
        if found.code != code:
            raise AssertionError(f"the error is {found.code} {found.reason}, expected {code}")

    @property
    def _simulator(self) -> Simulator:
        return self._started[0]

    @property
    def _robot(self) -> Iiwa:
        return self._started[1]

    @property
    def _started(self) -> tuple[Simulator, Iiwa]:
        if self._running is None:
            simulator = Simulator(**self._options).__enter__()
            self._running = simulator, Iiwa(simulator.host, simulator.port)
        return self._running

    def _does(self, move: Any) -> None:
        try:
            move(self._robot)
        except CommandError as refused:
            error = self._robot.get_error()
            raise AssertionError(f"refused: {error.code} {error.reason}") from refused
