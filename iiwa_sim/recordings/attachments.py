"""The files that a recording has with it."""

from contextlib import suppress
from pathlib import Path

from iiwa_sim.cell.cell import Cell


def attachments_of(cell: Cell) -> dict[str, tuple[str, bytes]]:
    """The files that a robot in its cell is made of, with their media types: what is needed to draw it
    elsewhere."""
    description = cell.description
    found = {"robot.urdf": ("application/xml", description.urdf.encode())}
    for name, path in (("robot.toml", Path(description.settings_path)), ("cell.toml", cell.path)):
        if path is not None:
            with suppress(OSError):  # gone since it was read
                found[name] = ("application/toml", path.read_bytes())
    return found
