"""Time of the next tick: at a pace, or on request."""
