"""One move into the next: corners, and the chain that the robot runs along."""
