"""Which web pages may use a port that browsers can reach.

A browser lets any page open a WebSocket to any machine and names that page in the header Origin; other
clients send no Origin. A page can also make the name of its own site resolve to one of our addresses (DNS
rebinding): the header Host then has that name.
"""

import ipaddress
import re
from collections.abc import Sequence
from urllib.parse import urlsplit

from iiwa_sim.server.token import is_loopback
from iiwa_sim.wording import harmless, shortened

LOCALHOST = "localhost"
NO_SITE = "null"
"""Origin of a page without a site, such as a file or a sandboxed frame."""
_ORIGIN = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://[!-.0-~]+")  # no path behind it
_LONGEST_SHOWN = 100


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
        host = _host_of(f"//{hosts[0]}")
        if host is None or not (_is_address(host) or _is_local(host) or host in self._hosts):
            return f"the host '{_shown(hosts[0])}' is no address, not localhost, and not named"
        for origin in origins:
            its_host = _host_of(origin)
            if origin.lower() not in self._origins and (its_host is None or not _is_local(its_host)):
                return f"the web page comes from '{_shown(origin)}', which is not this machine and not named"
        return None


def _checked_origin(origin: str) -> str:
    is_site = _ORIGIN.fullmatch(origin) is not None and _host_of(origin) is not None
    if not is_site and origin != NO_SITE:
        raise ValueError(f"'{_shown(origin)}' is no origin, expected scheme://host or scheme://host:port")
    return origin.lower()


def _checked_host(name: str) -> str:
    if _host_of(f"//{name}") != name.lower() or not name.isprintable():
        raise ValueError(f"'{_shown(name)}' is no host name, expected one without scheme and port")
    return name.lower()


def _host_of(url: str) -> str | None:
    try:
        parts = urlsplit(url)
        host = parts.hostname
        _ = parts.port  # which raises, if it is none
    except ValueError:
        return None
    return None if not host or "@" in parts.netloc else host.removesuffix(".")


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _is_local(host: str) -> bool:
    return host.endswith(f".{LOCALHOST}") or is_loopback(host)


def _shown(text: str) -> str:
    return shortened(harmless(text), _LONGEST_SHOWN)
