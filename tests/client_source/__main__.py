"""The clients' methods, written from the tables in protocol/: `python -m tests.client_source`.

Writes iiwa_sim/client/commands.py, krc4.py, their async kin and krc4_numbers.py; tests compare them with the
tables.
"""

from __future__ import annotations

from tests.client_source import iiwa, krc4
from tests.client_source.text import FOLDER


def main() -> None:
    for kind in iiwa.KINDS:
        (FOLDER / kind.file).write_text(iiwa.source(kind))
    for kind in krc4.KINDS:
        (FOLDER / kind.file).write_text(krc4.source(kind))
    (FOLDER / krc4.NUMBERS).write_text(krc4.numbers_source())


if __name__ == "__main__":
    main()
