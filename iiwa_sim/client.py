"""A small blocking client for drivers and tests: one method per command of the iiwa's line protocol.

    with Iiwa("127.0.0.1", 30000) as robot:
        robot.lin_move((600, 0, 500, 3.14159, 0, 3.14159), speed=0.5, blending=0)
        robot.wait_until_stopped(timeout_s=10)
        print(robot.get_joint_position())

Methods are called as the commands of protocol/iiwa.toml, and its units hold: mm, rad, N, Nm, speeds relative
to the limits (0 < speed <= 1). `target` is x y z (mm, base frame) alpha beta gamma (rad, intrinsic Z-Y-X), as
a Frame holds it. It needs nothing of the simulator and works with any server of the protocol.
"""

import math
import socket
import time
import tomllib
from collections.abc import Sequence
from importlib.resources import files
from types import TracebackType
from typing import Any, NamedTuple, Self

_TABLE = tomllib.loads(files("iiwa_sim.protocol").joinpath("iiwa.toml").read_text())
_COMMANDS: dict[str, Any] = _TABLE["command"]

_POLL_PERIOD_S = 0.01
_MAX_REPLY_BYTES = 65536
_REASON = "its log has the reason"


class CommandError(Exception):
    """The robot answered `error`; the message quotes the command."""


class UnknownCommandError(CommandError):
    """The robot answered `unknown command`: the server is older than this client, or another one."""


class ReplyError(Exception):
    """The reply does not fit the command: client and server are out of step, or the protocol is another."""


class Frame(NamedTuple):
    """A pose in the base frame: mm, and intrinsic Z-Y-X angles in rad."""

    x: float
    y: float
    z: float
    alpha: float
    beta: float
    gamma: float


class JointPosition(NamedTuple):
    """Positions of A1 to A7 in rad."""

    j0: float
    j1: float
    j2: float
    j3: float
    j4: float
    j5: float
    j6: float


class JointTorque(NamedTuple):
    """External torques on A1 to A7 in Nm."""

    t0: float
    t1: float
    t2: float
    t3: float
    t4: float
    t5: float
    t6: float


class CartesianForce(NamedTuple):
    """Force (N) and torque (Nm) at the TCP, in TCP orientation, acting on the robot."""

    fx: float
    fy: float
    fz: float
    tx: float
    ty: float
    tz: float


class LastError(NamedTuple):
    """A result code of robot_movement_interface, and the reason in words."""

    code: int
    reason: str


class Iiwa:
    """One connection. Not for use by several threads at once.

    Every command raises CommandError where the robot answers `error`, ReplyError where the answer makes no
    sense, and OSError (TimeoutError among them) where the connection fails. The latter two close the
    connection: a late reply would be taken for the next one's. On a closed one every command raises
    ConnectionError, an OSError. Wrong counts and numbers that are not finite raise ValueError before anything
    is sent.
    """

    def __init__(self, host: str, port: int, timeout_s: float = 5.0) -> None:
        """Connects; `timeout_s` bounds that and the wait for each reply."""
        self._socket = socket.create_connection((host, port), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._replies = self._socket.makefile("rb")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection. A robot that still carries out a move of this client stops."""
        self._replies.close()
        self._socket.close()

    def wait_until_stopped(self, timeout_s: float) -> None:
        """Returns when the robot is at rest; raises TimeoutError, and keeps the connection, if it is not."""
        deadline = time.monotonic() + timeout_s
        while self.get_status() != "stopped":
            if time.monotonic() > deadline:
                raise TimeoutError(f"the robot still moves after {timeout_s} s")
            time.sleep(_POLL_PERIOD_S)

    def hello(self) -> None:
        """The robot listens."""
        self._command("hello")

    def bye(self) -> None:
        """Stops the robot and ends the connection."""
        self._command("bye")
        self.close()

    def help(self, command: str = "") -> str:
        """All commands, or the usage of one."""
        return self._ask(f"help : {' '.join(command.split())}")

    def joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """All joints together, straight in joint space; seven positions, seven speeds."""
        self._command("joint move", *joints, *speeds)

    def lin_move(self, target: Sequence[float], speed: float, blending: float) -> None:
        """The TCP on a straight line to a frame; blending in mm."""
        self._command("lin move", *target, speed, blending)

    def lin_joint_move(self, joints: Sequence[float], speed: float, blending: float) -> None:
        """The TCP on a straight line to where it is at joint positions; blending in mm."""
        self._command("lin joint move", *joints, speed, blending)

    def ptp_move(self, target: Sequence[float], speed: float, blending: float) -> None:
        """The TCP to a frame, straight in joint space; blending in mm."""
        self._command("ptp move", *target, speed, blending)

    def linr_move(self, target: Sequence[float], speed: float, blending: float, r: float) -> None:
        """As lin_move, with joint A3 at r (rad) at the target."""
        self._command("linr move", *target, speed, blending, r)

    def ptpr_move(self, target: Sequence[float], speed: float, blending: float, r: float) -> None:
        """As ptp_move, with joint A3 at r (rad) at the target."""
        self._command("ptpr move", *target, speed, blending, r)

    def linforcez_move(
        self, target: Sequence[float], speed: float, blending: float, thresholdZ: float
    ) -> None:
        """As lin_move, until the force along z has changed by the threshold (N)."""
        self._command("linforcez move", *target, speed, blending, thresholdZ)

    def ptpforcez_move(
        self, target: Sequence[float], speed: float, blending: float, thresholdZ: float
    ) -> None:
        """As ptp_move, until the force along z has changed by the threshold (N)."""
        self._command("ptpforcez move", *target, speed, blending, thresholdZ)

    def linforce_move(
        self,
        target: Sequence[float],
        speed: float,
        blending: float,
        thresholdX: float,
        thresholdY: float,
        thresholdZ: float,
    ) -> None:
        """As lin_move, until a force has changed by its threshold (N)."""
        self._command("linforce move", *target, speed, blending, thresholdX, thresholdY, thresholdZ)

    def ptpforce_move(
        self,
        target: Sequence[float],
        speed: float,
        blending: float,
        thresholdX: float,
        thresholdY: float,
        thresholdZ: float,
    ) -> None:
        """As ptp_move, until a force has changed by its threshold (N)."""
        self._command("ptpforce move", *target, speed, blending, thresholdX, thresholdY, thresholdZ)

    def linstiff_move(
        self, target: Sequence[float], speed: float, stiffness: float, force: Sequence[float]
    ) -> None:
        """As lin_move, pulled by a spring (N/m); `force` is what it shall balance: N, Nm, at the TCP."""
        self._command("linstiff move", *target, speed, stiffness, *force)

    def ptpstiff_move(
        self, target: Sequence[float], speed: float, stiffness: float, force: Sequence[float]
    ) -> None:
        """As ptp_move, pulled by a spring (N/m); `force` is what it shall balance: N, Nm, at the TCP."""
        self._command("ptpstiff move", *target, speed, stiffness, *force)

    def start_gravity(self, joint_stiffness: float) -> None:
        """Holds the joints by springs (Nm/rad) until stop."""
        self._command("start gravity", joint_stiffness)

    def smart_joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """To a joint position from wherever the robot is now, in place of the smart move before."""
        self._command("smart joint move", *joints, *speeds)

    def smart_cartesian_move(self, target: Sequence[float], speed: float) -> None:
        """The flange to a frame from wherever the robot is now, in place of the smart move before."""
        self._command("smart cartesian move", *target, speed)

    def direct_joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """To a joint position at most 0.087 rad from the present one on any axis."""
        self._command("direct joint move", *joints, *speeds)

    def direct_cartesian_move(self, target: Sequence[float], speed: float) -> None:
        """The flange to a frame that no axis is more than 0.087 rad from."""
        self._command("direct cartesian move", *target, speed)

    def stop(self) -> None:
        """Brings the robot to rest on its path and discards all waiting moves."""
        self._command("stop")

    def get_status(self) -> str:
        """`moving` or `stopped`."""
        return self._command("get status")

    def get_mode(self) -> str:
        """`unknown`, `normal`, `impedance`, `smart` or `direct`."""
        return self._command("get mode")

    def get_error(self) -> LastError:
        """What was refused, or has stopped the robot, last; code 0 and "none" if there was neither."""
        reply = self._ask("get error")
        code, _, reason = reply.partition(" ")
        if not (code.isascii() and code.isdigit()):
            self.close()
            raise ReplyError(f"get error answered {reply!r}")
        return LastError(int(code), reason)

    def get_tool_frame(self) -> Frame:
        """The TCP in the base frame."""
        return Frame._make(self._numbers("get tool frame"))

    def get_flange_frame(self) -> Frame:
        """The flange, without tool, in the base frame."""
        return Frame._make(self._numbers("get flange frame"))

    def get_joint_position(self) -> JointPosition:
        """Positions of all joints."""
        return JointPosition._make(self._numbers("get joint position"))

    def get_joint_torque(self) -> JointTorque:
        """External torques on all joints."""
        return JointTorque._make(self._numbers("get joint torque"))

    def get_cartesian_force(self) -> CartesianForce:
        """Force and torque at the TCP."""
        return CartesianForce._make(self._numbers("get cartesian force"))

    def _command(self, name: str, *values: float) -> str:
        """Sends a command that answers a word of the table, and returns that word."""
        expected = len(_COMMANDS[name].get("parameters", "").split())
        if len(values) != expected:
            raise ValueError(f"{name}: expected {expected} numbers, got {len(values)}")
        if not all(map(math.isfinite, values)):
            raise ValueError(f"{name}: expected finite numbers, got {values}")
        parameters = " ".join(repr(float(value)) for value in values)
        reply = self._ask(f"{name} : {parameters}" if values else name)
        if reply not in _COMMANDS[name]["reply"]["words"]:
            self.close()
            raise ReplyError(f"{name} answered {reply!r}")
        return reply

    def _numbers(self, name: str) -> list[float]:
        """Sends a command that answers numbers."""
        reply = self._ask(name)
        try:
            values = [float(word) for word in reply.split()]
        except ValueError:
            values = []
        if len(values) != len(_COMMANDS[name]["reply"]["values"].split()):
            self.close()
            raise ReplyError(f"{name} answered {reply!r}")
        return values

    def _ask(self, line: str) -> str:
        """Sends a line and returns the line it is answered by."""
        if self._socket.fileno() < 0:
            raise ConnectionError("this connection is closed; a new Iiwa(host, port) opens another")
        try:
            self._socket.sendall(line.encode() + b"\r\n")
            reply = self._replies.readline(_MAX_REPLY_BYTES)
            if not reply.endswith(b"\n"):
                raise ConnectionResetError(f"the connection ended before the answer to {line!r}")
        except BaseException:
            self.close()
            raise
        text = reply.decode("ascii", "replace").strip()
        if text == "unknown command":
            raise UnknownCommandError(f"the server answered unknown command to {line!r}; {_REASON}")
        if text == "error":
            raise CommandError(f"the server answered error to {line!r}; {_REASON}")
        return text
