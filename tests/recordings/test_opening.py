"""The file of a recording, before anything is recorded."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.opening import MAGIC, opened
from tests.talking import DEADLINE_S

RECORDS = ("-m", "iiwa_sim", "--port", "0", "--record")


@pytest.mark.slow
@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_where_the_program_speaks_it_does_not_record(stream: str, tmp_path: Path) -> None:
    path = tmp_path / "said.txt"
    path.write_text("before\n")
    streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with path.open("a") as said:
        done = subprocess.run(
            [sys.executable, *RECORDS, str(path)],
            **{**streams, stream: said},
            timeout=DEADLINE_S,
            check=False,
        )
    assert done.returncode == 2
    told = f"iiwa-sim: {path}: expected the name of a file, to write a recording there\n"
    assert path.read_text() == ("before\n" + told if stream == "stderr" else "before\n")


def test_a_file_that_was_there_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_text("something else")
    opened(path).close()
    assert path.read_bytes() == MAGIC
    with pytest.raises(RecordingFault, match="expected the name of a file"):
        opened(tmp_path)
