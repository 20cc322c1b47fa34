"""What protocols share: lines, command tables, numbers, the dialogue, and faults of the wire."""
