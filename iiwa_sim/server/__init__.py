"""Network servers: bytes in, bytes out, without their meaning."""
