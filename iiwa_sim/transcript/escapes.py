r"""Escapes for bytes that do not print: `\x09`, `\\` for a backslash, `\x7b` for a literal brace."""

import re


def wire_bytes(text: str) -> bytes:
    """The bytes for a text. Raises ValueError for a malformed escape."""
    return re.sub(rb"\\(x[0-9a-f]{2}|.|$)", _unescaped, text.encode())


def _unescaped(found: re.Match[bytes]) -> bytes:
    escape = found[1]
    if escape.startswith(b"x") and len(escape) == 3:
        return bytes([int(escape[1:], 16)])
    plain = {b"\\": b"\\", b"'": b"'", b"t": b"\t", b"n": b"\n", b"r": b"\r"}
    if escape not in plain:
        raise ValueError(f"no escape: {found[0]!r}")
    return plain[escape]
