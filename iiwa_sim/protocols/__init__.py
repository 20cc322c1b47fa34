"""Protocols: the wire on one side, the controller on the other; no sockets."""
