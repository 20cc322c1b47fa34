"""Numbers on the wire: which texts are numbers, and how a reply writes one.

A number is what the original's Java takes for a double: `1`, `1.`, `+.5`, `1e3`, `1E-5`; not `1_000`, `1,5`,
`nan`, `inf` or `0x10`. A reply writes decimals that read back within 1e-9, never with an exponent, never
`-0.0`, always with a point: `0.0`, `600.0`, `-1.570796327`.
"""

import math
import re
from collections.abc import Sequence

_NOT_DECIMAL = re.compile(rb"[^0-9eE.+\-]")  # float() also takes underscores, nan, inf and words
_LONGEST_QUOTE = 40


def parse_decimal(word: bytes) -> float:
    """Return the finite number that `word` stands for. Raises ValueError, which quotes it, for none."""
    try:
        value = math.nan if _NOT_DECIMAL.search(word) else float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{quoted(word)}: expected a number")
    return value


def quoted(wire: bytes) -> str:
    """Return a word from the wire as text for a message: escaped, and cut if it is long."""
    return readable(wire[:_LONGEST_QUOTE]) + ("..." if len(wire) > _LONGEST_QUOTE else "")


def readable(wire: bytes) -> str:
    """Return bytes from the wire as text for a log: characters outside printable ASCII are escaped."""
    return repr(wire)[2:-1]


def format_decimals(values: Sequence[float]) -> bytes:
    """Return values as text, separated by one blank; raises ValueError where one is not finite."""
    if not all(map(math.isfinite, values)):
        raise ValueError(f"{values} have no place in a reply")
    texts = [f"{value:z.9f}".rstrip("0") for value in values]  # z: no minus before 0
    return " ".join([text + "0" if text[-1] == "." else text for text in texts]).encode()
