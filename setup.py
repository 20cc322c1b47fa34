"""The one thing pyproject.toml cannot say: the packages found under iiwa_sim, and two that lie beside it."""

from setuptools import find_packages, setup

setup(packages=[*find_packages(include=["iiwa_sim", "iiwa_sim.*"]), "iiwa_sim.protocol", "iiwa_sim.robots"])
