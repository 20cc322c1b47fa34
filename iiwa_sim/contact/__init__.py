"""Contact: pushes from outside, surfaces, noise, and the torques that result."""

from pathlib import Path

from iiwa_sim.kernels import check_kernels

check_kernels(Path(__file__).parent)
