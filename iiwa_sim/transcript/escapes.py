r"""Bytes that do not print, as text: `\x09`, a backslash `\\`, a brace that is one `\x7b`."""

import re


def wire_bytes(text: str) -> bytes:
    """What is sent for a text. Raises ValueError for an escape that is none."""
    return re.sub(rb"\\(x[0-9a-f]{2}|.|$)", _unescaped, text.encode())


def _unescaped(found: re.Match[bytes]) -> bytes:
    escape = found[1]
    if escape.startswith(b"x") and len(escape) == 3:
        return bytes([int(escape[1:], 16)])
    plain = {b"\\": b"\\", b"'": b"'", b"t": b"\t", b"n": b"\n", b"r": b"\r"}
    if escape not in plain:
        raise ValueError(f"no escape: {found[0]!r}")
    return plain[escape]
