"""Shells with sockets: bytes in, bytes out, nothing of what they mean."""
