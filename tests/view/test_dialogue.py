"""Lines of a dialogue as the page shows them."""

from __future__ import annotations

import re

from iiwa_sim.view.dialogue import listed

LINES = [
    {"time_s": 1.0, "session": "127.0.0.1:40001", "mark": ">", "text": "lin move : <b>1</b>"},
    {
        "time_s": 1.0,
        "session": "127.0.0.1:40001",
        "mark": "<",
        "text": "error",
        "reason": "3040 it takes 8 values",
    },
    {"time_s": 1.5, "session": "127.0.0.1:40002", "mark": ">", "text": "get status"},
    {"time_s": 1.5, "session": "127.0.0.1:40002", "mark": "<", "text": "stopped"},
    {"time_s": 2.0, "session": "robot", "mark": "#", "text": "3030 emergency stop"},
]


def texts(page: str) -> list[str]:
    """The lines from the first to the last, which the page has the other way round."""
    return [re.sub("<[^>]*>", "", row) for row in page.split("</div>")][-3::-1]


def test_the_lines_stand_with_time_client_and_reason() -> None:
    assert texts(listed(LINES)) == [
        "1.000 40001 &gt; lin move : &lt;b&gt;1&lt;/b&gt;",
        "1.000 40001 &lt; error (3040 it takes 8 values)",
        "1.500 40002 &gt; get status",
        "1.500 40002 &lt; stopped",
        "2.000 robot # 3030 emergency stop",
    ]


def test_the_filter_is_of_clients_and_of_text_with_reasons() -> None:
    assert len(texts(listed(LINES, "127.0.0.1:40002"))) == 2
    assert len(texts(listed(LINES, text="STATUS"))) == 1
    assert len(texts(listed(LINES, text="8 values"))) == 1
    assert len(texts(listed(LINES, text="#"))) == 1
    assert len(texts(listed(LINES, text="Refused"))) == 1
    assert texts(listed(LINES, "127.0.0.1:40001", "stopped <i>")) == ["no line with stopped &lt;i&gt;"]
