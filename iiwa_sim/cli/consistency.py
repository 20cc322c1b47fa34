"""Which options of a server go together; what is not named is set."""

import argparse

from iiwa_sim.backdoor.token import LOOPBACK, Token, check_reach
from iiwa_sim.cli.addresses import settle_ports
from iiwa_sim.cli.options import check_robot
from iiwa_sim.cli.parsing import Error


def check(error: Error, options: argparse.Namespace) -> None:
    """Check the options of one robot for consistency, and set ports that are not named; `error` reports a
    fault."""
    check_robot(error, options)
    settle_ports(error, options)
    if options.status_rate is not None:
        if options.status_port is None:
            error("argument --status-rate: expected --status-port with it")
        if options.status_rate > options.rate:
            limit = f"the {options.rate} ticks per second of --rate"
            error(f"argument --status-rate: {options.status_rate} is above {limit}")
    if options.record_rate is not None:
        if options.record is None:
            error("argument --record-rate: expected --record with it")
        if options.record_rate > options.rate:
            limit = f"the {options.rate} ticks per second of --rate"
            error(f"argument --record-rate: {options.record_rate} is above {limit}")
    if options.rosbridge_secret is not None and options.rosbridge_port is None:
        error("argument --rosbridge-secret: expected --rosbridge-port with it")
    for name, given in (("origin", options.rosbridge_origin), ("host", options.rosbridge_host)):
        if given and options.rosbridge_port is None:
            error(f"argument --rosbridge-{name}: expected --rosbridge-port with it")
    check_ros2(error, options)
    _check_backdoor(error, options)
    _check_view(error, options)


def check_ros2(error: Error, options: argparse.Namespace) -> None:
    """Ends the program where an interpreter or a namespace is given, but no node of ROS 2."""
    if options.ros2_python is not None and not options.ros2:
        error("argument --ros2-python: expected --ros2 with it")
    if options.ros_namespace and not options.ros2:
        error("argument --ros-namespace: expected --ros2 with it")


def _check_backdoor(error: Error, options: argparse.Namespace) -> None:
    """Ends the program where the backdoor has a host or a token but no port, or a port that other machines
    reach but no token."""
    has_port = options.backdoor_port is not None or options.backdoor_http_port is not None
    tokens = (options.backdoor_token, options.backdoor_token_file)
    for name, given in zip(("host", "token", "token-file"), (options.backdoor_host, *tokens), strict=True):
        if given is not None and not has_port:
            wanted = "expected --backdoor-port or --backdoor-http-port with it"
            error(f"argument --backdoor-{name}: {wanted}")
    if None not in tokens:
        error("argument --backdoor-token-file: expected no --backdoor-token with it")
    text = options.backdoor_token if options.backdoor_token is not None else options.backdoor_token_file
    try:
        token = None if text is None else Token(text)
        check_reach(options.backdoor_host or LOOPBACK, token, option="--backdoor-token-file")
    except ValueError as fault:
        error(f"argument --backdoor-{'host' if text is None else 'token'}: {fault}")


def _check_view(error: Error, options: argparse.Namespace) -> None:
    """Host and token go with a port; and the page has a status port and a backdoor to be one of."""
    tokens = (options.view_token, options.view_token_file)
    if options.view_port is None:
        for name, given in zip(("host", "token", "token-file"), (options.view_host, *tokens), strict=True):
            if given is not None:
                error(f"argument --view-{name}: expected --view-port with it")
        return
    options.view_host = options.view_host or LOOPBACK
    if None not in tokens:
        error("argument --view-token-file: expected no --view-token with it")
    text = options.view_token if options.view_token is not None else options.view_token_file
    try:
        token = None if text is None else Token(text)
        check_reach(options.view_host, token, "page", "--view-token-file")
    except ValueError as fault:
        error(f"argument --view-{'host' if text is None else 'token'}: {fault}")
    if options.status_port is None:
        options.status_port = 0
    if options.backdoor_port is None:
        options.backdoor_port = 0
