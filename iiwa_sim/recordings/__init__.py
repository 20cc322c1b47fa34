"""Recordings of a robot in MCAP: written while it runs, read, drawn, exported, played: docs/recordings.md."""

from pathlib import Path

from iiwa_sim.kernels import check_kernels

check_kernels(Path(__file__).parent)
