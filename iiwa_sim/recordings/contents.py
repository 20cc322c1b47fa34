"""What is handed over of a run, made the messages of its recording: in the process that writes it."""

from collections.abc import Iterable, Iterator
from typing import Any

import msgspec

from iiwa_sim.protocols.dialogue import DialogueLine
from iiwa_sim.recordings.handed import Handed, Ready, Said
from iiwa_sim.recordings.message import Message
from iiwa_sim.recordings.schemas import DIALOGUE
from iiwa_sim.recordings.times import Times
from iiwa_sim.recordings.views import Views


class Contents:
    """Makes them, of what is handed over in the order of time."""

    def __init__(self, views: Views, times: Times) -> None:
        """`views` are of the robot that is recorded, and of nobody else."""
        self._views = views
        self._times = times
        self._encode = msgspec.json.Encoder().encode

    def made(self, handed: Iterable[Handed]) -> Iterator[Message]:
        """The messages that these become, in their order."""
        log_ns, expand = self._times.log_ns, self._views.expand
        for each in handed:
            if isinstance(each, Ready):
                message = Message(each.topic, each.data, log_ns(each.tick), each.real_ns)
                yield message
                yield from expand(message)
            elif isinstance(each, Said):
                said = self._encode(self._said(each.line, each.real_ns))
                yield Message(DIALOGUE, said, log_ns(each.line.tick), each.real_ns)

    def _said(self, said: DialogueLine, real_ns: int) -> dict[str, Any]:
        return {
            **self._times.when(said.tick, real_ns),
            "session": said.session,
            "direction": said.direction.value,
            "text": said.text,
            "reason": said.reason,
            "protocol": said.protocol,
        }
