"""How this driver writes a command."""


def line(name: str, *values: float) -> bytes:
    """A command as it goes over the wire."""
    numbers = " ".join(f"{value:.9f}" for value in values)
    return f"{name} : {numbers}\r\n".encode() if values else f"{name}\r\n".encode()
