"""Peers that answer KRC4 messages, with their values as elements or as attributes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping

import pytest

from iiwa_sim.client import Krc4
from tests.krc4_talking import FULL, elements


def asked(wire: bytes) -> dict[str, str]:
    """A request's values, as another parser reads them."""
    root = ET.fromstring(wire)
    assert root.tag == "Cmd"
    return {child.tag: child.text or "" for child in root}


def replying(
    write: Callable[[str, Mapping[str, object]], bytes] = elements, **values: object
) -> Callable[[bytes], bytes]:
    """Answers each request with its ids and these values."""

    def answer(wire: bytes) -> bytes:
        request = asked(wire)
        return write("Res", FULL | {"I0": request["I0"], "I1": request["I1"]} | values)

    return answer


def assert_closed(client: Krc4) -> None:
    for call in (client.fin, client.goa, client.sto, lambda: client.gio(1)):
        with pytest.raises(ConnectionError, match="this connection is closed"):
            call()
    client.close()
