"""Which web pages may use a port that browsers can reach.

A browser lets any page open a WebSocket to any machine and names that page in the header Origin; other
clients send no Origin. A page can also make the name of its own site resolve to one of our addresses (DNS
rebinding): the header Host then has that name.
"""

import re
from collections.abc import Sequence

from iiwa_sim.server.token import is_loopback
from iiwa_sim.wording import harmless, shortened

LOCALHOST = "localhost"
_HOST = r"(?P<host>\[[0-9A-Fa-f:.]+\]|[\w.-]*[\w-])\.?(?::\d{1,5})?"
_PLACE = re.compile(_HOST, re.ASCII)
_ORIGIN = re.compile(rf"[A-Za-z][A-Za-z0-9+.-]*://{_HOST}", re.ASCII)
_ADDRESS = re.compile(r"[0-9.]+|\[.*\]")  # the last part of a name is never a number


class WebAccess:
    """Admits clients that are no web page, pages of this machine, and pages of the named `origins`."""

    def __init__(self, origins: Sequence[str] = (), hosts: Sequence[str] = ()) -> None:
        """`origins` as browsers write them, scheme://host[:port]; `hosts` are further names of this machine.

        Raises ValueError for an origin or a host that is malformed.
        """
        self._origins = frozenset(_checked_origin(each) for each in origins)
        self._hosts = frozenset(_checked_host(each) for each in hosts)

    def refusal(self, hosts: Sequence[str], origins: Sequence[str]) -> str | None:
        """Why a request with these headers Host and Origin is refused; None if it is admitted."""
        if len(hosts) != 1:
            return f"{len(hosts)} headers Host: expected one"
        host = _host_of(_PLACE, hosts[0])
        if not (_ADDRESS.fullmatch(host) or _is_local(host) or host in self._hosts):
            return f"the host '{_shown(hosts[0])}' is no address, not localhost, and not named"
        for origin in origins:
            if origin.lower() not in self._origins and not _is_local(_host_of(_ORIGIN, origin)):
                return f"the web page comes from '{_shown(origin)}', which is not this machine and not named"
        return None


def _checked_origin(origin: str) -> str:
    if not _host_of(_ORIGIN, origin) and origin != "null":  # a page without a site, such as a file
        raise ValueError(f"'{_shown(origin)}' is no origin, expected scheme://host or scheme://host:port")
    return origin.lower()


def _checked_host(name: str) -> str:
    if _host_of(_PLACE, name) != name.lower():
        raise ValueError(f"'{_shown(name)}' is no host name, expected one without scheme and port")
    return name.lower()


def _host_of(pattern: re.Pattern[str], text: str) -> str:
    """Return the host in a text, in lower case; empty if there is none."""
    found = pattern.fullmatch(text)
    return "" if found is None else found["host"].lower()


def _is_local(host: str) -> bool:
    return host.endswith(f".{LOCALHOST}") or is_loopback(host.strip("[]"))


def _shown(text: str) -> str:
    return shortened(harmless(text), 100)
