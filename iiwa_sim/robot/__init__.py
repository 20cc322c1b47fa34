"""The arm: its description (`description`), forward kinematics (`model`) and inverse kinematics
(`inverse`)."""

from pathlib import Path

from iiwa_sim.kernels import check_kernels

check_kernels(Path(__file__).parent)
