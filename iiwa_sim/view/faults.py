"""A menu of what can fail: replies on the wire, and the robot itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from iiwa_sim.view.acting import acting, confirm

if TYPE_CHECKING:
    import viser

    from iiwa_sim.view.station import Station

ALL, NEXT = "all", "the next to come"
WIRE = {
    "late": "delay replies : {connection} {replies} {seconds:g}",
    "in two pieces": "split replies : {connection} {replies} {byte} {seconds:g}",
    "lost": "drop replies : {connection} {replies}",
    "garbled": "garble replies : {connection} {replies}",
    "closed instead": "close before replies : {connection} {replies}",
    "closed behind": "close after replies : {connection} {replies}",
    "reset instead": "reset at replies : {connection} {replies}",
    "no answer any more": "stop answering : {connection}",
}
"""Faults of replies, as lines of the backdoor."""
ROBOT = {
    "refuse the next move": "refuse next move : {code}",
    "fail the move under way": "fail move : {code}",
    "following error of joint 1": "following error : 1",
    "servo timeout": "servo timeout",
}
ENTRANCE = {"Refuse": "refuse connections", "Accept": "accept connections"}


class Faults:
    """The menu of one robot, in the panel."""

    def __init__(self, gui: viser.GuiApi, station: Station) -> None:
        self._station = station
        with gui.add_folder("Replies"):
            self._wire: Any = gui.add_dropdown("What happens", tuple(WIRE))
            self._connection: Any = gui.add_dropdown("Connection", (ALL, NEXT))
            self._replies: Any = gui.add_number("How many", 1, min=0, step=1, hint="0: until cleared")
            self._seconds: Any = gui.add_number("Seconds", 0.5, min=0.0, max=3600.0, step=0.1)
            self._byte: Any = gui.add_number("Bytes first", 3, min=1, step=1, hint="of a reply in two pieces")
            gui.add_button("Set", color="orange").on_click(
                acting(lambda event: self._do(event, self.wire_line()))
            )
            gui.add_button("Clear all faults").on_click(acting(lambda event: self._do(event, "clear faults")))
            gui.add_button_group("New clients", tuple(ENTRANCE)).on_click(
                acting(lambda event: self._do(event, ENTRANCE[event.target.value]))
            )
        with gui.add_folder("Robot", expand_by_default=False):
            self._robot: Any = gui.add_dropdown("What fails", tuple(ROBOT))
            self._code: Any = gui.add_number("Code", 4711, min=1, max=2**31 - 1, step=1)
            gui.add_button("Have it fail", color="orange").on_click(
                acting(
                    lambda event: self._do(event, ROBOT[self._robot.value].format(code=int(self._code.value)))
                )
            )

    def _do(self, event: Any, line: str) -> None:
        """Have the backdoor carry out a line, and tell so: nothing else on the page shows it."""
        self._station.act(line)
        confirm(event.client, line)

    def wire_line(self) -> str:
        """The line of the backdoor for what is chosen."""
        chosen = self._connection.value
        number = {ALL: 0, NEXT: -1}.get(chosen)
        return WIRE[self._wire.value].format(
            connection=chosen.partition(" ")[0] if number is None else number,
            replies=int(self._replies.value),
            seconds=float(self._seconds.value),
            byte=int(self._byte.value),
        )

    def show(self) -> None:
        """Name the connections there are now."""
        there = tuple(f"{number} {client}" for number, client in self._station.connections.items())
        options = (ALL, NEXT, *there)
        if options != tuple(self._connection.options):
            self._connection.options = options
