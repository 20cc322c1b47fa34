"""What becomes of a test that lacks a program."""

from __future__ import annotations

import sys

import pytest

from tests.needed import program


def test_a_test_without_its_program_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CI", raising=False)
    with pytest.raises(pytest.skip.Exception, match="no-such-program is not there"):
        program("no-such-program")


def test_in_ci_it_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "true")
    with pytest.raises(pytest.fail.Exception, match="no-such-program is not there"):
        program("no-such-program")
    assert program(sys.executable) == sys.executable
