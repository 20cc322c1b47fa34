"""A joint trajectory, told as points with times, and how the robot follows it within its limits."""
