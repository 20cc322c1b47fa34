"""What moves, as data: one folder per robot, robot.urdf and robot.toml. Installed as iiwa_sim.robots."""
