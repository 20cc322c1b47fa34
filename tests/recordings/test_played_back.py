"""What was recorded plays back to the same joint positions at every tick, bit for bit."""

from __future__ import annotations

import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.recordings.read import Happened, Recorded
from iiwa_sim.recordings.schemas import STATE
from tests.mixes import Mix
from tests.recordings.recorded import RATE_HZ, Robot, contents
from tests.samples import some

MOST_COMMANDS = 8


def session(seed: int) -> dict[str, float]:
    """Play a session by its seed."""
    return {"ticks": check_session(seed, 1 + seed % MOST_COMMANDS)}


def check_session(seed: int, commands: int) -> int:
    """Plays what was recorded back to the same joints at every tick, bit for bit; gives how many ticks."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "session.mcap")
        robot = recorded_session(path, seed, commands)
        # By the library's reader, which goes by the index, and by ours, which does not.
        played = {state["tick"]: tuple(state["joint_position"]) for state in contents(path, STATE)}
        assert played == robot.joints
        recorded = Recorded(path)
        assert {state.tick: state.joint_position for state in recorded.contents("/state")} == robot.joints
        assert recorded.cut_at_s is None
        check_moves(list(recorded.contents("/events")), robot.controller.accepted)
        return len(played)


def recorded_session(path: Path, seed: int, commands: int) -> Robot:
    """A number of lines, at any ticks, then a stop, until the robot rests; the recording has ended."""
    mix = Mix(seed, 1.0 / RATE_HZ, forces=False)
    controller = mix.robot.controller
    robot = Robot(path, robot_alone("lbr_iiwa_7_r800"), controller=controller)
    step = controller.step

    def stepped() -> None:
        step()
        robot.ticked()

    controller.step = stepped
    for _ in range(commands):
        mix._say(mix._line())
        mix.step(mix._random.choice([0, 1, 2, mix._random.randrange(50)]))
    mix._say("set override : 1")
    mix._say("stop")
    mix.robot.runs_until_stopped()
    robot.end()
    assert robot.recorder.lost == 0
    return robot


def check_moves(events: list[Happened], accepted: int) -> None:
    """Each move ends once, and one that begins does so between its acceptance and its end."""
    moves = [event for event in events if event.move]
    ended = [event.move for event in moves if event.kind == "move ends"]
    assert sorted(ended) == list(range(1, accepted + 1))
    begun = [event.move for event in moves if event.kind == "move begins"]
    arrived = {event.move for event in moves if event.kind == "move ends" and event.code == 0}
    assert len(set(begun)) == len(begun)
    assert arrived <= set(begun)
    for move in begun:
        of_it = [event.kind for event in moves if event.move == move and event.kind != "contact"]
        assert of_it == ["move accepted", "move begins", "move ends"]


@settings(max_examples=some(15))
@given(seed=st.integers(0, 2**32), commands=st.integers(1, MOST_COMMANDS))
def test_random_sessions(seed: int, commands: int) -> None:
    check_session(seed, commands)
