"""Contact: pushes from outside, surfaces, noise, and the torques that result."""
