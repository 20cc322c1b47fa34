"""Steps in which a server sends a reply, or does otherwise: what wire faults make of it."""

from typing import NamedTuple

from iiwa_sim.wording import shortened

_LONGEST_TOLD = 80  # characters of a reply shown in the log


class Send(NamedTuple):
    """Send bytes in one write."""

    data: bytes


class Wait(NamedTuple):
    """Wait for real seconds: a driver knows no other time."""

    seconds: float


class Close:
    """Close the connection by FIN. Commands without a reply get none."""


class Reset:
    """Reset the connection by RST. Data that the client has not received is lost."""


Step = Send | Wait | Close | Reset


def text_of(step: Step, reply: bytes) -> str:
    """A step as text for people."""
    match step:
        case Send(data):
            text = data.decode("ascii", "backslashreplace")
            text = text.replace("\r", "\\r").replace("\n", "\\n")
            return "the reply" if data == reply else f"'{shortened(text, _LONGEST_TOLD)}'"
        case Wait(seconds):
            return f"{seconds:g} s of silence"
        case Close():
            return "the end (FIN)"
        case Reset():
            return "the end (RST)"
