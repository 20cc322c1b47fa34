"""What the process that writes a recording says of it, a line each."""

ALIVE = b""
"""The process has begun, or has written what it was given."""
WHOLE = b"whole"
"""The file has its end; the last sign."""
FAULT = b"fault "
"""Nothing more is written, for the reason behind it; the last sign."""
LONGEST_SIGN = 1024
"""Bytes."""
