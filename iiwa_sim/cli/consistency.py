"""Which options of a server go together; what is not named is set."""

import argparse
from collections.abc import Collection

from iiwa_sim.cli.addresses import settle_ports
from iiwa_sim.cli.options import check_robot
from iiwa_sim.cli.parsing import Error
from iiwa_sim.cli.reach import BACKDOOR, PAGE, check_token
from iiwa_sim.dialect.ports import IIWA

BACKDOOR_PORTS = ("backdoor_port", "backdoor_http_port")
ON_ROS = ("rosbridge_port", "ros", "ros2")
NEEDS = {
    "status_rate": ("status_port",),
    "record_rate": ("record",),
    **dict.fromkeys(("rosbridge_secret", "rosbridge_origin", "rosbridge_host"), ("rosbridge_port",)),
    **dict.fromkeys(("ros2_python", "ros_namespace"), ("ros2",)),
    **dict.fromkeys(("ros_result", "ros_reference", "ros_stamps"), ON_ROS),
    **dict.fromkeys(("backdoor_host", "backdoor_token", "backdoor_token_file"), BACKDOOR_PORTS),
    **dict.fromkeys(("view_host", "view_token", "view_token_file"), ("view_port",)),
}
"""Options that mean something only with another one, or with one of several."""


def check(error: Error, options: argparse.Namespace) -> None:
    """Check the options of one robot for consistency, and set ports and addresses that are not named; `error`
    reports a fault."""
    check_robot(error, options)
    settle_ports(error, options)
    check_needs(error, options)
    for name in ("status_rate", "record_rate"):
        if (getattr(options, name) or 0) > options.rate:
            limit = f"the {options.rate} ticks per second of --rate"
            error(f"argument {_shown(name)}: {getattr(options, name)} is above {limit}")
    if any(_is_given(options, port) for port in BACKDOOR_PORTS):
        check_token(error, options, "backdoor-", BACKDOOR)
    if options.view_port is not None:
        check_token(error, options, "view-", PAGE)
        if options.status_port is None:  # which the page is a client of
            options.status_port = 0
        if options.backdoor_port is None:
            options.backdoor_port = 0


def check_needs(error: Error, options: argparse.Namespace) -> None:
    """Ends the program where an option is given without the one that it needs."""
    for name, needed in NEEDS.items():
        if _is_given(options, name) and not any(_is_given(options, other) for other in needed):
            error(f"argument {_shown(name)}: expected {' or '.join(map(_shown, needed))} with it")


def check_dialect(error: Error, options: argparse.Namespace, dialects: Collection[str]) -> None:
    """Ends the program where an option of the iiwa's protocol is given and clients can speak only others."""
    for name in ("strict", "bye_shuts_down"):
        if _is_given(options, name) and IIWA not in dialects:
            error(f"argument {_shown(name)}: expected --dialect {IIWA} with it")


def _is_given(options: argparse.Namespace, name: str) -> bool:
    value = getattr(options, name, None)
    return value is not None and value is not False and value not in ([], "")


def _shown(name: str) -> str:
    return f"--{name.replace('_', '-')}"
