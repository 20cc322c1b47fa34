"""Finds deviations of a server of the iiwa's line protocol from the original, through its socket."""
