"""A driver for a KRC4, with one socket and the XML of the standard library."""

import socket
import time
import xml.etree.ElementTree as ET

POSES = {
    "above": (445.0, 0.0, 620.0, 180.0, 0.0, 180.0),
    "left": (445.0, 250.0, 620.0, 180.0, 0.0, 180.0),
    "touching": (445.0, 0.0, 602.0, 180.0, 0.0, 180.0),
}
"""Frames of the TCP: X Y Z in mm, A B C in degrees."""

STO, LIN, FIN, GOP = 1, 10, 100, 310


class RobotError(Exception):
    """The number of what the robot refused a message for."""


class ProtocolError(Exception):
    """The received message is no reply to the sent one."""


class Driver:
    """Moves the robot between the poses that have names."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), timeout=5.0)
        self._received = b""
        self._messages = 0

    def start(self, pose: str) -> None:
        """Send a LIN to a pose."""
        self._ask(LIN, *POSES[pose])

    def go(self, pose: str) -> None:
        """Send a LIN to a pose and wait until the robot rests there."""
        self.start(pose)
        while not self._ask(FIN)["I2"]:
            time.sleep(0.01)

    def stop(self) -> None:
        self._ask(STO)

    def goal_mm(self) -> tuple[float, float, float]:
        """X, Y and Z of where the robot goes, or stands."""
        reply = self._ask(GOP)
        return reply["R0"], reply["R1"], reply["R2"]

    def close(self) -> None:
        self._socket.close()

    def _ask(self, command: int, *reals: float) -> dict[str, float]:
        """Return the numbers of the reply, by their names."""
        self._messages += 1
        message = ET.Element("Cmd", I0=str(self._messages), I1=str(command))
        message.attrib.update({f"R{place}": repr(value) for place, value in enumerate(reals)})
        self._socket.sendall(ET.tostring(message))
        reply = self._reply()
        if (reply["I0"], abs(reply["I1"])) != (self._messages, command):
            raise ProtocolError(f"expected a reply to message {self._messages}")
        if reply["I1"] < 0:
            raise RobotError(f"{reply['I2']:.0f}")
        return reply

    def _reply(self) -> dict[str, float]:
        """Return the next reply, up to the end of its root."""
        end = b"</Res>"
        while end not in self._received:
            received = self._socket.recv(4096)
            if not received:
                raise ConnectionError("the robot has closed the connection")
            self._received += received
        text, _, self._received = self._received.partition(end)
        try:
            return {value.tag: float(value.text) for value in ET.fromstring(text + end)}
        except (ET.ParseError, TypeError, ValueError) as fault:
            raise ProtocolError(f"no reply: {fault}") from None
