"""The file of a recording, before anything is recorded."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from iiwa_sim.recordings.fault import RecordingFault
from iiwa_sim.recordings.opening import MAGIC, opened
from tests.talking import DEADLINE_S

NO_ROOM = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
from pathlib import Path
from iiwa_sim.recordings.opening import opened
opened(Path(sys.argv[1]))
"""
RECORDS = ("-m", "iiwa_sim", "--port", "0", "--record")


@pytest.mark.skipif(sys.platform == "win32", reason="its limits are others")
def test_where_nothing_finds_room_no_file_is_left(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    done = subprocess.run(
        [sys.executable, "-c", NO_ROOM, str(path)],
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )
    assert done.stderr.endswith(f"{path}: cannot be written: File too large\n")
    assert not path.exists()


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
