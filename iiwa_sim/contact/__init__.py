"""What the robot feels: pushes from outside, surfaces, noise, and the torques they make."""
