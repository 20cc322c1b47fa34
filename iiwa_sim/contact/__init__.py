"""What the robot feels: pushes from outside and, in a later version, surfaces, and the torques they make."""
