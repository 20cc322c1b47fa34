"""What the robot works with: a gripper, and the parts that it picks, carries and drops."""

from pathlib import Path

from iiwa_sim.kernels import check_kernels

check_kernels(Path(__file__).parent)
