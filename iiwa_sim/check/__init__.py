"""What a server of the iiwa's line protocol does otherwise than the original: asked over its socket."""
