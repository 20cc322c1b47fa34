"""The emulated controller: takes commands, checks and plans them, and steps the robot through them."""

from pathlib import Path

from iiwa_sim.kernels import check_kernels

check_kernels(Path(__file__).parent)
