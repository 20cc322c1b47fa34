"""What the robot works with: a gripper, and the parts that it picks, carries and drops."""
