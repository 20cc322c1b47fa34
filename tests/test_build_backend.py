"""Tests of the build backend: it names missing platforms and compilers in one line."""

from __future__ import annotations

import platform
import runpy
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def backend(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    monkeypatch.setenv("CC", "cc")  # so that it leaves the environment alone
    monkeypatch.delenv("CXX", raising=False)
    return runpy.run_path(str(Path(__file__).parent.parent / "build_backend.py"))


def test_windows_is_rejected_with_an_alternative(
    backend: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(SystemExit, match=r"pin .* has no wheels for Windows: use WSL 2"):
        backend["get_requires_for_build_wheel"]()


def test_arm_linux_without_a_compiler_is_told_what_to_install(
    backend: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(platform, "machine", lambda: "aarch64")
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(SystemExit, match=r"ruckig has no wheels for ARM Linux.*such as g\+\+"):
        backend["get_requires_for_build_wheel"]()
