"""Pictures of motion: runs a file of commands in simulated time and draws the result."""
