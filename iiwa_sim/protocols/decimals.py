"""Numbers on the wire: which texts are numbers, and how a reply writes one.

A number is what the original's Java takes for a double: `1`, `1.`, `+.5`, `1e3`, `1E-5`; not `1_000`, `1,5`,
`nan`, `inf` or `0x10`. A reply writes decimals that read back within 1e-9, never with an exponent, never
`-0.0`, always with a point: `0.0`, `600.0`, `-1.570796327`.
"""

import math
import re
from collections.abc import Sequence

import msgspec

_to_json = msgspec.json.Encoder().encode  # the fastest text for a float; never used for exponents
NOT_DECIMAL = re.compile(rb"[^0-9eE.+\-]")  # float() also takes underscores, nan, inf and words

_LONGEST_QUOTE = 40


class NotANumberError(ValueError):
    """A word is no finite number; the message quotes it and tells what was expected."""


def parse_decimal(word: bytes) -> float:
    """Return the number that `word` stands for. Raises NotANumberError, also for 1e400."""
    try:
        value = float(b"" if NOT_DECIMAL.search(word) else word)
    except ValueError:
        raise NotANumberError(f"{quoted(word)}: expected a number") from None
    if not math.isfinite(value):
        raise NotANumberError(f"{quoted(word)}: expected a number up to 1.8e308")
    return value


def quoted(wire: bytes) -> str:
    """A word from the wire as text for a message: escaped, and cut if it is long."""
    return readable(wire[:_LONGEST_QUOTE]) + ("..." if len(wire) > _LONGEST_QUOTE else "")


def readable(wire: bytes) -> str:
    """Bytes from the wire as text for a log: characters outside printable ASCII are escaped."""
    return repr(wire)[2:-1]


def format_decimals(values: Sequence[float]) -> bytes:
    """Values separated by one blank; raises ValueError where one is not finite."""
    # Adding and taking away 1.5 * 2**52 rounds to a whole number, and makes 0.0 of -0.0. It does so up to
    # 2**51; larger values go as they are.
    text = _to_json(
        [(v * 1e9 + 6755399441055744.0 - 6755399441055744.0) / 1e9 if -1e6 < v < 1e6 else v for v in values]
    )
    if b"e" in text or b"n" in text:
        return b" ".join([_format_rare(value) for value in values])
    return text[1:-1].replace(b",", b" ")


def _format_rare(value: float) -> bytes:
    """One value whose shortest form may have an exponent."""
    if not math.isfinite(value):
        raise ValueError(f"{value} has no place in a reply")
    text = (b"%.9f" % value).rstrip(b"0")
    if text.endswith(b"."):
        text += b"0"
    return b"0.0" if text == b"-0.0" else text
