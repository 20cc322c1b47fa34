"""The dialogue of a recording, as a transcript to be played."""

from collections.abc import Iterator

from iiwa_sim.protocols.dialogue import DialogueLine, Direction
from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.read import Recorded, Spoken
from iiwa_sim.recordings.schemas import DIALOGUE
from iiwa_sim.transcript.lines import Transcript, read
from iiwa_sim.transcript.record import Lines


def transcript_of(recorded: Recorded) -> Transcript:
    """What was said, at its simulated times since the recording began.

    A line whose reply is not in the recording, at the end of one that was cut off, is left out. Raises
    RecordingFault, and TranscriptFault for a dialogue that makes no sense.
    """
    protocols = recorded.head.metadata.get("protocols", "").split()
    if not protocols:
        raise RecordingFault(f"{recorded.path}: it does not tell its protocols")
    lines = Lines(protocols, 0)
    text = [lines.header(f"from {recorded.path.name}")]
    start = next(recorded.states(), None)
    start_s = 0.0 if start is None else start.time_s
    for spoken in _answered(recorded):
        told = DialogueLine(
            spoken.session,
            Direction(spoken.direction),
            spoken.text,
            spoken.tick,
            round(spoken.real_s * 1e9),
            spoken.reason,
            spoken.protocol,
        )
        text.append(lines.line(told, max(0.0, spoken.time_s - start_s)) + "\n")
    return read(str(recorded.path), "".join(text))


def _answered(recorded: Recorded) -> Iterator[Spoken]:
    """All that was said, but lines and replies that have lost each other."""
    unanswered: dict[str, Spoken] = {}
    directions = {each.value for each in Direction}
    for spoken in recorded.dialogue():
        if spoken.direction not in directions:
            told = f"expected a direction of {' '.join(sorted(directions))}"
            raise RecordingFault(f"{recorded.path}: {DIALOGUE}: {told}")
        if spoken.direction == Direction.FROM_CLIENT.value:
            unanswered[spoken.session] = spoken
        elif spoken.direction == Direction.TO_CLIENT.value:
            line = unanswered.pop(spoken.session, None)
            if line is not None:
                yield line
                yield spoken
        else:
            yield spoken
