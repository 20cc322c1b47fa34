"""Hypothesis strategies for bytes that arrive in pieces."""

from hypothesis import strategies as st


@st.composite
def cut(draw: st.DrawFn, stream: bytes) -> list[bytes]:
    """`stream` in packets, cut anywhere, some of them empty."""
    places = draw(st.lists(st.integers(0, len(stream)), max_size=12).map(sorted))
    return [stream[a:b] for a, b in zip([0, *places], [*places, len(stream)], strict=True)]
