"""A recording plays at the chosen speed, from where it is put, up to its end."""

from __future__ import annotations

import pytest

from iiwa_sim.recordings.player import Player

START_S, END_S = 2.0, 5.0


def test_it_plays_at_its_speed_and_stands_still_at_the_end() -> None:
    player = Player(START_S, END_S)
    player.passes(1.0)
    assert player.time_s == START_S, "nobody has said play"
    player.play()
    player.passes(0.5)
    player.speed = 2.0
    player.passes(0.5)
    assert player.time_s == pytest.approx(3.5)
    player.pause()
    player.passes(1.0)
    assert player.time_s == pytest.approx(3.5)
    player.play()
    player.passes(10.0)
    assert (player.time_s, player.playing) == (END_S, False)
    player.play()
    assert (player.time_s, player.playing) == (START_S, True)
