"""`tools/hunt.py` says what has failed, with what it was about."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HUNTED = """
class Scene:
    def __init__(self, seed):
        self.gained = 0.5 * seed
        self.shape = "box"


MOST = 1.0


def bare(seed):
    scene = Scene(seed)
    check(scene)
    return {"gained": scene.gained}


def check(scene):
    assert scene.gained <= MOST


def told(seed):
    assert seed < 2, "too many"
    return {}


def broken(seed):
    return {"one": 1 / (seed - 1)}
"""


def hunt(folder: Path, function: str, *more: str) -> tuple[int, str]:
    """Seeds 0 to 4 of one of these, or as many as `more` says."""
    (folder / "hunted.py").write_text(HUNTED)
    root = Path(__file__).parent.parent
    code = f"import sys; sys.path[:0] = [{str(root)!r}, {str(folder)!r}]; from tools.hunt import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, f"hunted:{function}", "0", "4", *more],
        capture_output=True,
        text=True,
        cwd=folder,
        check=False,
    )
    assert done.stderr == ""
    return done.returncode, done.stdout


def test_a_bare_assert_is_told_with_its_values_and_with_the_scene(tmp_path: Path) -> None:
    code, said = hunt(tmp_path, "bare")
    assert code == 1
    assert "3: assert scene.gained <= MOST\n" in said
    assert "    scene.gained = 1.5\n" in said
    assert "    MOST = 1.0\n" in said
    assert "    scene = Scene(gained=1.5, shape='box')\n" in said
    assert said.endswith("4 seeds from 0, 1 failed\ngained: 1 at most, of seed 2\n")


def test_a_message_is_told_with_where_it_is_from(tmp_path: Path) -> None:
    code, said = hunt(tmp_path, "told")
    assert code == 1
    assert "2: too many\n    at hunted.py:" in said
    assert "4 seeds from 0, 2 failed" in said


def test_whatever_is_raised_ends_one_seed_only(tmp_path: Path) -> None:
    code, said = hunt(tmp_path, "broken")
    assert code == 1
    assert "1: ZeroDivisionError: division by zero\n" in said
    assert "4 seeds from 0, 1 failed\none: 1 at most, of seed 2\n" in said


def test_it_ends_in_time(tmp_path: Path) -> None:
    code, said = hunt(tmp_path, "bare", "--seconds", "-1")
    assert (code, said) == (0, "0 seeds from 0, 0 failed\n")
