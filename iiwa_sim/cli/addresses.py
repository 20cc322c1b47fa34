"""The options for listening addresses. Imports nothing that loads slowly."""

import argparse

from iiwa_sim.cli.parsing import Error, Parser, whole
from iiwa_sim.dialect.ports import DEFAULT_DIALECT, DEFAULT_PORTS, MAX_PORT
from iiwa_sim.wording import shortened

MOST_ROBOTS = 10_000


def add_addresses(parser: Parser) -> None:
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on; 0.0.0.0 for all (default: %(default)s)"
    )
    parser.add_argument(
        "--dialect",
        type=_dialects,
        default=[DEFAULT_DIALECT],
        metavar="NAME[,NAME]",
        help=f"protocol, {' or '.join(DEFAULT_PORTS)}; with several, each has its port "
        f"(default: {DEFAULT_DIALECT})",
    )
    usual = ", ".join(f"{port} for {name}" for name, port in DEFAULT_PORTS.items())
    parser.add_argument(
        "--port",
        type=_ports,
        metavar="PORT[,PORT]",
        help=f"port to listen on, one for each dialect; 0 picks a free one (default: {usual})",
    )
    parser.add_argument(
        "--count",
        type=whole(1, MOST_ROBOTS),
        metavar="NUMBER",
        help="run so many robots in this process, robot-0, robot-1 and so on, each with ports one above "
        "those of the one before (default: one robot, without a name)",
    )
    parser.add_argument(
        "--fleet",
        metavar="FLEET.toml",
        help="run the robots that this file names, with options of their own (default: one robot)",
    )


def settle_ports(error: Error, options: argparse.Namespace) -> None:
    """Set a port for each dialect; the usual ones if none is named."""
    if options.port is None:
        options.port = [DEFAULT_PORTS[name] for name in options.dialect]
    elif options.port == [0]:
        options.port *= len(options.dialect)
    elif len(options.port) != len(options.dialect):
        wanted = f"expected {len(options.dialect)}, one for each dialect"
        error(f"argument --port: {len(options.port)} given, {wanted}")


def reached_at(host: str) -> str:
    """The address on this machine of a server that listens on `host`."""
    return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # among all addresses


def _ports(text: str) -> list[int]:
    port = whole(0, MAX_PORT)
    return [port(each) for each in text.split(",")]


def _dialects(text: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in DEFAULT_PORTS or names.count(name) > 1:
            known = " or ".join(DEFAULT_PORTS)
            shown = shortened(repr(text), 40)
            raise argparse.ArgumentTypeError(f"{shown}: expected {known}, each at most once, a comma between")
    return names
