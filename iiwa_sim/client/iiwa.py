"""Client for the text protocol of the iiwa."""

import contextlib
from collections.abc import Callable
from math import isfinite
from typing import TypeVar

from iiwa_sim.client import replies
from iiwa_sim.client.connection import Client, Floats, exactly
from iiwa_sim.client.replies import CommandError, ReplyError, UnknownCommandError

__tracebackhide__ = True  # pytest shows the line of the test instead
T = TypeVar("T")
_STATE = {"0": False, "1": True}.__getitem__


class Iiwa(Client):
    """A robot that speaks the text protocol; a method has the name of its command.

    Units are mm, rad, N, Nm. `target` is x y z alpha beta gamma in the base frame, as `Frame`. Speeds are
    relative to the velocity limits of the joints, 0 to 1. `blending` is the radius around the target, in mm,
    in which the next move may take over.

    Every command raises `CommandError` if the robot rejects it, `ReplyError` for a malformed reply, and
    `OSError` (`TimeoutError` among them) if the connection fails. The latter two close the connection. A
    wrong number of values, and values that are not finite, raise `ValueError` before anything is sent.
    """

    def command(self, name: str, *values: float | str) -> str:
        """Send a command with its values in their order, and return the reply. Raises CommandError."""
        words = " ".join(map(_word, values))
        line = " ".join(f"{name} : {words}".split()) if words else name
        reply = self._ask(line)
        if reply not in ("error", "unknown command"):
            return reply
        last = replies.LastError(0, "")
        with contextlib.suppress(OSError, ValueError):  # a server without `get error` has no reason
            last = _last_error(self._ask("get error"))
        why = f"{last.code} {last.reason}" if last.code else "its log has the reason"
        kind = CommandError if reply == "error" else UnknownCommandError
        raise kind(f"the server answered {reply} to {line!r}: {why}", last.code, last.reason)

    def hello(self) -> None:
        """Check that the controller answers."""
        self._read({"hello": None}.__getitem__, "hello")

    def bye(self) -> None:
        """Stop the robot and end the connection."""
        self._read({"bye": None}.__getitem__, "bye")
        self.close()

    def help(self, command: str = "") -> str:
        """Return the names of the commands, or the usage of one, or what an error code means."""
        return self.command("help", command)

    def joint_move(self, joints: Floats, speeds: Floats) -> None:
        """Move all seven joints together, straight in joint space; one speed for each joint."""
        self._do("joint move", *exactly(7, joints), *exactly(7, speeds))

    def lin_move(self, target: Floats, speed: float, blending: float) -> None:
        """Move the TCP on a straight line."""
        self._do("lin move", *exactly(6, target), speed, blending)

    def ptp_move(self, target: Floats, speed: float, blending: float) -> None:
        """Move the TCP to a frame, straight in joint space."""
        self._do("ptp move", *exactly(6, target), speed, blending)

    def lin_relative_move(self, shift: Floats, speed: float, blending: float) -> None:
        """Move the TCP on a line by a shift and a turn in the axes of the base, from the end of the queue."""
        self._do("lin relative move", *exactly(6, shift), speed, blending)

    def linr_move(self, target: Floats, speed: float, blending: float, r: float) -> None:
        """Move the TCP on a straight line to a frame that is reached with A3 at `r`."""
        self._do("linr move", *exactly(6, target), speed, blending, r)

    def ptpr_move(self, target: Floats, speed: float, blending: float, r: float) -> None:
        """Move the TCP to a frame that is reached with A3 at `r`, straight in joint space."""
        self._do("ptpr move", *exactly(6, target), speed, blending, r)

    def linforcez_move(self, target: Floats, speed: float, blending: float, thresholdZ: float) -> None:
        """Move as `lin_move`, and end early when the force along z has changed by more than its threshold."""
        self._do("linforcez move", *exactly(6, target), speed, blending, thresholdZ)

    def ptpforcez_move(self, target: Floats, speed: float, blending: float, thresholdZ: float) -> None:
        """Move as `ptp_move`, and end early when the force along z has changed by more than its threshold."""
        self._do("ptpforcez move", *exactly(6, target), speed, blending, thresholdZ)

    def linforce_move(self, target: Floats, speed: float, blending: float, *thresholds: float) -> None:
        """Move as `lin_move`, and end early when a force has changed by more than its threshold: x, y, z."""
        self._do("linforce move", *exactly(6, target), speed, blending, *exactly(3, thresholds))

    def ptpforce_move(self, target: Floats, speed: float, blending: float, *thresholds: float) -> None:
        """Move as `ptp_move`, and end early when a force has changed by more than its threshold: x, y, z."""
        self._do("ptpforce move", *exactly(6, target), speed, blending, *exactly(3, thresholds))

    def linstiff_move(self, target: Floats, speed: float, stiffness: float, force: Floats) -> None:
        """Move the TCP on a line, compliant by `stiffness` (N/m); `force`, of six values, is subtracted."""
        self._do("linstiff move", *exactly(6, target), speed, stiffness, *exactly(6, force))

    def ptpstiff_move(self, target: Floats, speed: float, stiffness: float, force: Floats) -> None:
        """Move the TCP as `linstiff_move`, but straight in joint space."""
        self._do("ptpstiff move", *exactly(6, target), speed, stiffness, *exactly(6, force))

    def start_gravity(self, joint_stiffness: float) -> None:
        """Hold every joint by a spring (Nm/rad) where it is, until a stop or a stiffness move."""
        self._do("start gravity", joint_stiffness)

    def smart_joint_move(self, joints: Floats, speeds: Floats) -> None:
        """Head for a joint position; replaces the target before."""
        self._do("smart joint move", *exactly(7, joints), *exactly(7, speeds))

    def smart_cartesian_move(self, target: Floats, speed: float) -> None:
        """Head with the flange for a frame; replaces the target before."""
        self._do("smart cartesian move", *exactly(6, target), speed)

    def direct_joint_move(self, joints: Floats, speeds: Floats) -> None:
        """Head for a joint position at most 0.087 rad from the present one on any axis."""
        self._do("direct joint move", *exactly(7, joints), *exactly(7, speeds))

    def direct_cartesian_move(self, target: Floats, speed: float) -> None:
        """Head with the flange for a frame that no axis is more than 0.087 rad from."""
        self._do("direct cartesian move", *exactly(6, target), speed)

    def stop(self) -> None:
        """Bring the robot to rest on its path and discard all waiting moves."""
        self._do("stop")

    def reset_error(self) -> None:
        """End the error state, and forget the last rejection."""
        self._do("reset error")

    def set_override(self, override: float) -> None:
        """Run all motions at this share of their speed, 0 (a pause) to 1."""
        self._do("set override", override)

    def set_tool_load(self, mass: float, centre: Floats) -> None:
        """Set the mass (kg) that the controller assumes at the flange, and its centre there."""
        self._do("set tool load", mass, *exactly(3, centre))

    def set_output(self, n: int, value: bool) -> None:
        """Switch a digital output, numbered from 1."""
        self._do("set output", n, int(value))

    def get_status(self) -> str:
        """Return `moving` or `stopped`; a robot paused in mid-motion is moving."""
        return self._read({"moving": "moving", "stopped": "stopped"}.__getitem__, "get status")

    def get_mode(self) -> str:
        """Return the mode of the last move: docs/protocol.md."""
        return self.command("get mode")

    def get_queue(self) -> int:
        """Return how many moves wait behind the one that runs."""
        return self._read(int, "get queue")

    def get_error(self) -> replies.LastError:
        """Return code and reason of the error state, else of the last rejection, else 0 and `none`."""
        return self._read(_last_error, "get error")

    def get_robot_status(self) -> replies.RobotStatus:
        """Return the state with the fields and values of ROS-Industrial's RobotStatus."""
        return self._read(lambda reply: replies.RobotStatus(*map(int, reply.split())), "get robot status")

    def get_tool_frame(self) -> replies.Frame:
        """Return the frame of the TCP."""
        return self._read(_row(replies.Frame), "get tool frame")

    def get_flange_frame(self) -> replies.Frame:
        """Return the frame of the flange."""
        return self._read(_row(replies.Frame), "get flange frame")

    def get_joint_position(self) -> tuple[float, ...]:
        """Return the positions of A1 to A7 (rad)."""
        return self._read(_joints, "get joint position")

    def get_joint_torque(self) -> tuple[float, ...]:
        """Return the external torques on A1 to A7 (Nm)."""
        return self._read(_joints, "get joint torque")

    def get_cartesian_force(self) -> replies.CartesianForce:
        """Return force and torque at the TCP, in its orientation, acting on the robot."""
        return self._read(_row(replies.CartesianForce), "get cartesian force")

    def get_output(self, n: int) -> bool:
        """Return the state of a digital output, numbered from 1."""
        return self._read(_STATE, "get output", n)

    def get_input(self, n: int) -> bool:
        """Return the state of a digital input, numbered from 1."""
        return self._read(_STATE, "get input", n)

    def _do(self, name: str, *values: float) -> None:
        self._read({"done": None}.__getitem__, name, *values)

    def _read(self, read: Callable[[str], T], name: str, *values: float) -> T:
        reply = self.command(name, *values)
        try:
            return read(reply)
        except (LookupError, TypeError, ValueError):
            self.close()
            raise ReplyError(f"{name!r} was answered {reply!r}") from None

    def _ask(self, line: str) -> str:
        return self._exchange(line, line.encode() + b"\r\n").decode("ascii", "replace").strip()

    def _is_stopped(self) -> bool:
        return self.get_status() == "stopped"


def _word(value: float | str) -> str:
    if isinstance(value, str):
        return value
    if not isfinite(value):
        raise ValueError(f"expected a finite number, got {value}")
    return str(value) if isinstance(value, int) else repr(float(value))


def _row(kind: Callable[..., T]) -> Callable[[str], T]:
    return lambda reply: kind(*map(float, reply.split()))


def _joints(reply: str) -> tuple[float, ...]:
    return tuple(exactly(7, list(map(float, reply.split()))))


def _last_error(reply: str) -> replies.LastError:
    code, _, reason = reply.partition(" ")
    return replies.LastError(int(code), reason)
