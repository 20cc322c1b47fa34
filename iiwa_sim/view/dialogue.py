"""The last lines of all connections, by client, with refusals in red and their reasons."""

from __future__ import annotations

import html
import time
from collections import deque
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from iiwa_sim.view.acting import acting

if TYPE_CHECKING:
    import viser

MOST = 200
"""Lines shown, the newest ones."""
EVERY_S = 0.4
"""Time between two updates of the list (s)."""
EVERYBODY = "everybody"
_BOX = (  # as high as the panel has room for, in a window of 600 pixels, too
    "max-height:max(8em,min(40vh,calc(100vh - 490px)));overflow:auto;display:flex;"
    "flex-direction:column-reverse;font-family:monospace;font-size:0.72em;line-height:1.35;padding:0 0.9em;"
    "overflow-wrap:anywhere"
)
_COLOURS = {">": "#1971c2", "<": "inherit", "#": "#868e96", "~": "#e8590c"}
_REFUSED = "#c92a2a"

Line = Mapping[str, Any]
"""A line with the keys `time_s`, `session`, `mark`, `text`, and `reason` where it was refused; see
`get dialogue` of the backdoor."""


class DialogueList:
    """A list of lines in the panel, with a filter by client and by text."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._lines: deque[Line] = deque(maxlen=MOST)
        self._client: Any = gui.add_dropdown("Client", (EVERYBODY,))
        self._filter: Any = gui.add_text("Filter", "", hint="text, a mark such as ~, or refused")
        self._html: Any = gui.add_html("")
        self._changed = True
        self._next_s = 0.0
        for each in (self._client, self._filter):
            each.on_update(acting(lambda _: self._touch()))

    def add(self, lines: Sequence[Line]) -> None:
        """Append lines, oldest first."""
        if lines:
            self._lines.extend(lines)
            self._changed = True

    def clear(self) -> None:
        """Show no lines."""
        self._lines.clear()
        self._changed = True

    def show(self) -> None:
        """Draw the list again if it has changed, and not too often."""
        now_s = time.monotonic()
        if not self._changed or now_s < self._next_s:
            return
        self._changed = False
        self._next_s = now_s + EVERY_S
        clients = (EVERYBODY, *sorted({str(line["session"]) for line in self._lines}))
        if clients != tuple(self._client.options):
            self._client.options = clients
        self._html.content = listed(self._lines, self._client.value, self._filter.value)

    def _touch(self) -> None:
        self._changed = True


def listed(lines: Sequence[Line] | deque[Line], client: str = EVERYBODY, text: str = "") -> str:
    """Lines as HTML: of one client, with this text, mark, or the word refused in them."""
    shown = [
        _row(line)
        for line in lines
        if client in (EVERYBODY, line["session"]) and text.strip().lower() in _sought(line)
    ] or [f"<div>no line with {html.escape(text)}</div>" if text else ""]
    # The box is filled from below, so that the newest line is in sight; that reverses the order.
    return f'<div style="{_BOX}">{"".join(reversed(shown))}</div>'


def _sought(line: Line) -> str:
    """What the filter looks for a text in."""
    reason = f"refused {line['reason']}" if line.get("reason") else ""
    return f"{line['mark']} {line['text']} {reason}".lower()


def _row(line: Line) -> str:
    reason = line.get("reason", "")
    colour = _REFUSED if reason else _COLOURS.get(line["mark"], "inherit")
    why = f" ({html.escape(reason)})" if reason else ""
    port = str(line["session"]).rpartition(":")[2]  # of a client; other names have no colon
    return (
        f'<div style="color:{colour}">{line["time_s"]:.3f} {html.escape(port)} {html.escape(line["mark"])} '
        f"{html.escape(line['text'])}{why}</div>"
    )
