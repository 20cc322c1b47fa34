"""Generates the methods of the clients from the tables in protocol/: `python -m tools.client_source`.

Writes iiwa_sim/client/_generated; tests compare the files with the tables.
"""

from __future__ import annotations

from tools.client_source import iiwa, krc4
from tools.client_source.text import FOLDER


def main() -> None:
    for kind in iiwa.KINDS:
        (FOLDER / kind.file).write_text(iiwa.source(kind))
    for kind in krc4.KINDS:
        (FOLDER / kind.file).write_text(krc4.source(kind))
    (FOLDER / krc4.NUMBERS).write_text(krc4.numbers_source())


if __name__ == "__main__":
    main()
