"""When the next tick happens: at a pace, or when it is asked for."""
