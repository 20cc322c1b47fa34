"""The arm: what is known of it (`description`), where its flange is (`model`), the way back (`inverse`)."""

from pathlib import Path

from iiwa_sim.kernels import check_kernels

check_kernels(Path(__file__).parent)
