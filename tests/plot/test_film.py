"""Films: which pictures they have, and how they are written."""

from __future__ import annotations

import re
import sys
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iiwa_sim.cli import main
from iiwa_sim.plot import film as films
from iiwa_sim.plot.fault import PlotFault
from iiwa_sim.plot.film import MOST_PICTURES, PICTURES_PER_S, film, ticks_shown
from iiwa_sim.plot.record import Recording
from tests.plot.scripts import JOINT, TABLE, recorded

FRAMES = re.compile(r'frames\[\d+\] = "data:image/png;base64,')
FFMPEG = f"""#!{sys.executable}
import sys
from pathlib import Path

given = sys.argv[1:]
taken = sys.stdin.buffer.read()
Path(given[-1]).write_text(" ".join([given[given.index("-s") + 1], str(len(taken))]))
"""


@pytest.fixture(scope="module")
def short() -> Recording:
    """Of a tenth of a second."""
    return recorded(f"{JOINT}\nwait 0.1\nstop", rate_hz=100)


def test_pictures_come_at_even_times_from_the_first_to_the_last(short: Recording) -> None:
    ticks = ticks_shown(short)
    assert (ticks[0], ticks[-1]) == (0, len(short.joints) - 1)
    assert len(ticks) == round(short.duration_s * PICTURES_PER_S) + 1
    assert set(np.diff(ticks)) <= {4, 5, 6}


def test_a_long_motion_has_no_more_pictures() -> None:
    assert len(ticks_shown(recorded("wait 60", rate_hz=100))) == MOST_PICTURES


def test_a_gif_plays_at_the_pace_of_the_robot(short: Recording) -> None:
    with Image.open(BytesIO(film(short, "gif"))) as image:
        assert image.n_frames == len(ticks_shown(short))
        assert image.info["duration"] == 1000 / PICTURES_PER_S
        first = image.convert("RGB").tobytes()
        image.seek(image.n_frames - 1)
        assert image.convert("RGB").tobytes() != first, "the arm has moved"


@pytest.mark.slow
def test_a_page_asks_no_other_host(short: Recording) -> None:
    page = film(short, "html").decode()
    assert len(FRAMES.findall(page)) == len(ticks_shown(short))
    assert "<link" not in page
    assert "://" not in page
    for symbol in set(re.findall(r'class="fa fa-([\w-]+)', page)):
        assert f".fa-{symbol}::before" in page


@pytest.mark.slow
def test_an_mp4_is_made_by_ffmpeg(short: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text(FFMPEG)
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    size, taken = film(short, "mp4").decode().split()
    width, height = map(int, size.split("x"))
    assert int(taken) == 4 * width * height * len(ticks_shown(short))
    program.write_text(f"#!{sys.executable}\nraise SystemExit(1)\n")
    with pytest.raises(PlotFault, match="the program ffmpeg has failed"):
        film(short, "mp4")


def test_without_ffmpeg_it_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    moves, output = tmp_path / "moves.txt", tmp_path / "a.mp4"
    moves.write_text("hello\n")
    assert main(["plot", str(moves), "--animate", str(output)]) == 2
    told = "a film in .mp4 needs the program ffmpeg, which is not in PATH: install it, or take .gif or .html"
    assert capsys.readouterr().err == f"iiwa-sim: {told}\n"
    assert not output.exists()


@pytest.mark.slow
def test_the_command_writes_picture_and_film_of_a_cell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(films, "MOST_PICTURES", 3)
    moves = tmp_path / "moves.txt"
    moves.write_text("linforcez move : 600 0 290 3.14159265359 0 3.14159265359 0.1 0 15\n")
    made = [tmp_path / "a.svg", tmp_path / "a.GIF"]
    options = ["--cell", str(TABLE), "--rate", "100", "-o", str(made[0]), "--animate", str(made[1])]
    assert main(["plot", str(moves), *options]) == 0
    with Image.open(made[1]) as image:
        assert image.n_frames == 3
    assert "1 LINFORCEZ 0.1" in made[0].read_text()
