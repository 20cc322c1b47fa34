"""A robot controller in software that speaks the LBR iiwa text protocol."""
