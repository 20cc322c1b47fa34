"""The emulated controller: takes commands, checks and plans them, and steps the robot through them."""
