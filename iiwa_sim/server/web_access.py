"""Admission of web pages to ports that browsers can reach.

A browser lets any page open a WebSocket to any machine and names that page in the header Origin; other
clients send no Origin. A page can also make the name of its own site resolve to one of our addresses (DNS
rebinding): the header Host then has that name.
"""

import re
from collections.abc import Sequence
from urllib.parse import urlsplit

from iiwa_sim.server.token import is_loopback

LOCALHOST = "localhost"
_ORIGIN = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://[^/\s]+|null")  # null is a page without a site, as a file
_ADDRESS = re.compile(r"[0-9.]+|.*:.*")  # the last part of a name is never a number


class WebAccess:
    """Access check that admits other clients than web pages, pages of this machine, and named `origins`."""

    def __init__(self, origins: Sequence[str] = (), hosts: Sequence[str] = ()) -> None:
        """`origins` as browsers write them, scheme://host[:port]; `hosts` are further names of this machine.

        Raises ValueError for an origin or a host that is malformed.
        """
        for origin in origins:
            if not _ORIGIN.fullmatch(origin):
                raise ValueError(f"{origin!r:.100} is no origin, expected scheme://host[:port]")
        for name in hosts:
            if _host_of(f"//{name}") != name.lower():
                raise ValueError(f"{name!r:.100} is no host name, expected one without scheme and port")
        self._origins, self._hosts = {each.lower() for each in origins}, {each.lower() for each in hosts}

    def refusal(self, hosts: Sequence[str], origins: Sequence[str]) -> str | None:
        """Why a request with these headers Host and Origin is refused; None if it is admitted."""
        if len(hosts) != 1:
            return f"{len(hosts)} headers Host: expected one"
        host = _host_of(f"//{hosts[0]}")
        if not (_ADDRESS.fullmatch(host) or _is_local(host) or host in self._hosts):
            return f"the host {hosts[0]!r:.100} is no address, not localhost, and admitted by no option"
        for origin in origins:
            if origin.lower() not in self._origins and not _is_local(_host_of(origin)):
                return f"the web page comes from {origin!r:.100}, not this machine and admitted by no option"
        return None


def _host_of(url: str) -> str:
    """Return the host in a URL, in lower case; empty if there is none."""
    try:
        return (urlsplit(url).hostname or "").removesuffix(".")
    except ValueError:
        return ""


def _is_local(host: str) -> bool:
    return host.endswith(f".{LOCALHOST}") or is_loopback(host)
