"""A library that refuses, in place of one of which nothing is called."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import pytest

from tests.needed import program
from tests.talking import DEADLINE_S
from tools.stand_in import put_in_place

LARGE = "namespace Large { int data = 1; void read() { data = 2; } } void other() {}"
USER = """
#include <exception>
namespace Large { extern int data; void read(); }
extern "C" int called() { return 1; }
extern "C" int refused() { try { Large::read(); } catch (const std::exception &) { return 2; } return 3; }
"""


def build(folder: Path, name: str, text: str, *options: str) -> None:
    words = [program("c++"), "-shared", "-fPIC", "-x", "c++", "-", "-o", str(folder / name), *options]
    subprocess.run(words, input=text, text=True, check=True, timeout=DEADLINE_S)


@pytest.fixture
def packages(tmp_path: Path) -> Path:
    """A library as large ones are installed: under several names."""
    build(tmp_path, "liblarge.so.1", LARGE, "-Wl,-soname,liblarge.so.1")
    (tmp_path / "liblarge.so").symlink_to("liblarge.so.1")
    return tmp_path


def built_user(packages: Path, text: str) -> None:
    here = [f"-L{packages}", f"-Wl,-rpath,{packages}", "-Wl,--no-as-needed"]
    build(packages, "user.so", text, *here, "-x", "none", "-llarge")


def test_what_needs_it_loads_and_what_is_called_refuses(packages: Path) -> None:
    built_user(packages, USER)
    assert put_in_place(packages, "liblarge.so", "Large").endswith(" and 1 functions that refuse")
    user = ctypes.CDLL(str(packages / "user.so"), mode=ctypes.DEFAULT_MODE)
    assert [user.called(), user.refused()] == [1, 2]


def test_a_library_whose_data_others_use_is_left_alone(packages: Path) -> None:
    built_user(packages, f"{USER}\nint *where = &Large::data;")
    before = (packages / "liblarge.so.1").read_bytes()
    told = put_in_place(packages, "liblarge.so", "Large")
    assert told == "liblarge.so stays: others use its data, such as _ZN5Large4dataE"
    assert (packages / "liblarge.so.1").read_bytes() == before


def test_a_library_that_is_not_there_is_none_to_replace(tmp_path: Path) -> None:
    assert put_in_place(tmp_path, "liblarge.so", "Large") == "liblarge.so is not there"
