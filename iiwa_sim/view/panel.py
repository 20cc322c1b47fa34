"""The panel beside the picture: pendant, pushes and dialogue of one robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from iiwa_sim.view.acting import acting
from iiwa_sim.view.dialogue import DialogueList
from iiwa_sim.view.pendant import Pendant
from iiwa_sim.view.pushing import Pushing

if TYPE_CHECKING:
    import viser

    from iiwa_sim.view.station import Station


PUSH = """\
Drag the arm: a spring pulls at it. It yields in a stiffness move and in a gravity hold: type
`linstiff move : 450 200 520 0 -1.57079 0 0.002 300 0 0 0 0 0 0` or
`start gravity : 200` under Dialogue, and `stop` to end it. Else it is stiff, and stays where it is. At the
flange the force is one at the TCP, elsewhere it is torques on the joints."""


class Panel:
    """All that one can read and do at a robot. Use it as a context, in which it pushes."""

    def __init__(self, server: viser.ViserServer, station: Station) -> None:
        gui = server.gui
        self._station = station
        self._pendant = Pendant(gui, station)
        self.stop = self._pendant.stop
        """Stops the robot, at an event."""
        self._dialogue: DialogueList | None = None
        self._pushing: Pushing | None = None
        if station.bench is None:
            return
        tabs = self._pendant.tabs
        with tabs.add_tab("Push"):
            self._pushing = Pushing(server, station)
            gui.add_markdown(PUSH)
        with tabs.add_tab("Dialogue"):
            if station.driver is not None:
                self._add_command(gui)
            self._dialogue = DialogueList(gui)

    def __enter__(self) -> Panel:
        if self._pushing is not None:
            self._pushing.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._pushing is not None:
            self._pushing.stop()

    def show(self) -> None:
        """What the newest state says, and what was said."""
        self._pendant.show()
        if self._pushing is not None:
            self._pushing.show()
        if self._dialogue is not None:
            said = []
            while self._station.said:
                said.append(self._station.said.popleft())
            self._dialogue.add(said)
            self._dialogue.show()

    def _add_command(self, gui: viser.GuiApi) -> None:
        station = self._station
        with gui.add_form(None) as form:
            command: Any = gui.add_text(
                "Command", "", hint="as on the wire, such as get status; Enter sends it"
            )

        def send(_event: Any) -> None:
            assert station.driver is not None
            line = " ".join(command.value.split())
            if line:
                command.value = ""
                station.driver.ask(line)
                station.look_now()

        form.on_submit(acting(send))
