"""What is done by the backdoor is in the dialogue that it tells."""

from __future__ import annotations

import json

from tests.backdoor.bench import Bench


def said(bench: Bench) -> list[tuple[str, str, str, str]]:
    told = json.loads(bench.tell("get dialogue : 0"))["lines"]
    return [(line["mark"], line["session"], line["text"], line.get("reason", "")) for line in told]


def test_what_a_line_or_a_call_changes_is_in_it_once() -> None:
    bench = Bench()
    bench.recent.listen()
    bench.tell("set input : 3 1")
    bench.backdoor.set_input(3, False)
    bench.tell("get inputs")
    bench.tell("get state")
    assert said(bench) == [
        ("#", "bench", "set input : 3 1", ""),
        ("#", "backdoor", "set_input(3, False)", ""),
    ], "and what only asks is not"


def test_what_is_refused_is_in_it_with_the_reason() -> None:
    bench = Bench()
    bench.recent.listen()
    assert bench.tell("remove surface : missing").startswith("error")
    ((mark, session, text, reason),) = said(bench)
    assert (mark, session, text) == ("#", "bench", "remove surface : missing")
    assert "missing" in reason


def test_what_is_dragged_is_in_it_now_and_then() -> None:
    bench = Bench()
    bench.recent.listen()
    for force in range(200):
        bench.tell(f"push : {force} 0 0 0 0 0")
    bench.tell("set input : 3 1")
    texts = [text for _, _, text, _ in said(bench)]
    assert texts[0] == "push : 0 0 0 0 0 0"
    assert texts[-1] == "set input : 3 1"
    assert len(texts) < 100
