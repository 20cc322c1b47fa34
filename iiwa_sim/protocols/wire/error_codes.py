"""What the error codes mean, what usually causes them and what to do: protocol/errors.toml, read."""

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from types import MappingProxyType

import msgspec

from iiwa_sim.protocols.wire.table_file import TableError


class ErrorCode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One row of the table; each value begins in lower case and ends without a full stop."""

    meaning: str
    cause: str
    """What usually causes it."""
    remedy: str
    """What to do."""

    def told(self, code: int) -> str:
        """All of it in one line."""
        return f"{code}: {self.meaning}; usual cause: {self.cause}; what to do: {self.remedy}"


@cache
def load_error_codes() -> Mapping[int, ErrorCode]:
    """The rows by code, in the order of the table. Raises TableError where it is wrong."""
    return read_error_codes(files("iiwa_sim.protocol").joinpath("errors.toml").read_bytes())


def read_error_codes(text: bytes) -> Mapping[int, ErrorCode]:
    """The rows from their TOML text."""
    try:
        rows = msgspec.toml.decode(text, type=dict[str, ErrorCode])
    except msgspec.DecodeError as fault:
        raise TableError(f"errors.toml: {fault}") from None
    for number in rows:
        if not number.isdecimal():
            raise TableError(f"errors.toml: {number}: expected a number")
    return MappingProxyType({int(number): row for number, row in rows.items()})
