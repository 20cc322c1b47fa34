"""Draws the table and the diagram of docs/modes.md from the controller's table: python -m docs.draw_modes"""

from pathlib import Path

from iiwa_sim.controller.modes import TRANSITIONS, Event, Mode

PAGE = Path(__file__).with_name("modes.md")
BEGIN = "<!-- drawn from iiwa_sim/controller/modes.py by: python -m docs.draw_modes -->\n"
END = "<!-- end of what is drawn -->\n"


def table() -> str:
    """One row for each mode, one column for each event."""
    rows = [["", *(event.value for event in Event)], ["---"] * (len(Event) + 1)]
    rows += [[f"**{mode.value}**", *(_cell(mode, event) for event in Event)] for mode in Mode]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def diagram() -> str:
    """Every change of mode; what happens within one is in the table."""
    lines = ["[*] --> " + Mode.UNKNOWN.value]
    for mode in Mode:
        for to in Mode:
            events = [event for event in Event if TRANSITIONS[mode, event].mode is to is not mode]
            if events:
                stops = any(TRANSITIONS[mode, event].stops for event in events)
                names = " or ".join(event.value for event in events)
                lines.append(f"{mode.value} --> {to.value} : {names}{' / the robot stops' if stops else ''}")
    return "```mermaid\nstateDiagram-v2\n" + "".join(f"    {line}\n" for line in lines) + "```\n"


def renewed(page: str) -> str:
    """The page with both drawn anew."""
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n{table()}\n{diagram()}\n{END}{after}"


def _cell(mode: Mode, event: Event) -> str:
    to, stops = TRANSITIONS[mode, event]
    if to is mode:
        return "stays"
    return f"stops, then {to.value}" if stops else to.value


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text()))
