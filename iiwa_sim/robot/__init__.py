"""The arm: `description`, forward kinematics in `model`, inverse kinematics in `inverse`."""
