"""Pictures of motion, from a file of commands or from a recording."""
