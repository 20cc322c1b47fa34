"""The names of the dialects and their usual ports. Imports nothing else."""

from collections.abc import Sequence

MAX_PORT = 65535
IIWA = "iiwa"
KRC4 = "krc4"
DEFAULT_DIALECT = IIWA
DEFAULT_PORTS = {
    IIWA: 30000,
    KRC4: 54600,  # the usual port of KUKA's EKI
}


def one_each(dialects: Sequence[str], port: int | Sequence[int]) -> Sequence[int]:
    """A port for each dialect. Raises ValueError."""
    if not dialects or len(set(dialects)) < len(dialects):
        raise ValueError(f"dialects are {', '.join(dialects) or 'none'}, expected one or more, each once")
    if port == 0:
        return [0] * len(dialects)
    ports = [port] if isinstance(port, int) else port
    if len(ports) != len(dialects):
        raise ValueError(f"port has {len(ports)}, expected {len(dialects)}, one for each dialect")
    return ports
