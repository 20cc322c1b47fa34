"""When a move is where: its nominal motion, alone from rest to rest, and the clock of all moves of a
segment."""
