"""Pictures of motion: a file of commands, run in simulated time, drawn."""
