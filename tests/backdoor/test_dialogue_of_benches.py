"""What is done by the backdoor is in the dialogue that it tells."""

from __future__ import annotations

import pytest

from iiwa_sim.controller.errors import Refused
from tests.backdoor.bench import Bench


def said(bench: Bench) -> list[tuple[str, str, str, str]]:
    return [(line.mark, line.session, line.text, line.reason) for line in bench.backdoor.dialogue().lines]


def test_what_a_call_changes_is_in_it_once() -> None:
    bench = Bench()
    bench.dialogue.remember()
    with bench.backdoor._by("bench"):
        bench.backdoor.set_input(number=3, on=True)
    bench.backdoor.set_input(3, False)
    bench.backdoor.inputs()
    bench.backdoor.state()
    assert said(bench) == [
        ("#", "bench", "set_input(number=3, on=True)", ""),
        ("#", "backdoor", "set_input(3, False)", ""),
    ], "and what only asks is not"


def test_what_is_refused_is_in_it_with_the_reason() -> None:
    bench = Bench()
    bench.dialogue.remember()
    with pytest.raises(Refused):
        bench.backdoor.remove_surface("missing")
    ((mark, session, text, reason),) = said(bench)
    assert (mark, session, text) == ("#", "backdoor", "remove_surface('missing')")
    assert reason.startswith("3000 no surface 'missing'")
