"""Network servers: bytes in, bytes out. Nothing here knows what the bytes mean."""
