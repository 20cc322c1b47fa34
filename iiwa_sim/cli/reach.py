"""Options of a port that other machines may reach: its address, and a token that clients have to send."""

import argparse
from pathlib import Path

from iiwa_sim.backdoor.token import LOOPBACK, Token, check_reach
from iiwa_sim.cli.parsing import Error, Parser
from iiwa_sim.serve.listening import why
from iiwa_sim.wording import shortened

BACKDOOR, PAGE = "backdoor", "page"
_WORDS = {
    BACKDOOR: (
        "these two listen",
        "serve only clients that send it: as first line, or as 'Authorization: Bearer TOKEN' over HTTP",
    ),
    PAGE: ("the page listens", "let only browsers in that know it"),
}


def add_reach(parser: Parser, prefix: str, what: str) -> None:
    """The options `--host`, `--token` and `--token-file`, with this prefix, of a backdoor or a page."""
    listener, token_is_for = _WORDS[what]
    parser.add_argument(
        f"--{prefix}host",
        metavar="HOST",
        help=f"address on which {listener}; one that other machines reach, such as 0.0.0.0, needs a token "
        f"(default: {LOOPBACK})",
    )
    parser.add_argument(
        f"--{prefix}token",
        metavar="TOKEN",
        help=f"{token_is_for}. Other users of this machine can read it in the list of processes "
        "(default: none)",
    )
    parser.add_argument(
        f"--{prefix}token-file", type=secret_in, metavar="FILE", help="the same, with the token in this file"
    )


def check_token(error: Error, options: argparse.Namespace, prefix: str, what: str) -> Token | None:
    """The token of the options of `add_reach`, None for none; the address is set where it is not named.

    `error` ends the program for two tokens, for one that is malformed, and for none where other machines
    reach the port.
    """
    name = prefix.replace("-", "_")
    host, word, in_file = (getattr(options, f"{name}{each}") for each in ("host", "token", "token_file"))
    if word is not None and in_file is not None:
        error(f"argument --{prefix}token-file: expected no --{prefix}token with it")
    text = in_file if word is None else word
    setattr(options, f"{name}host", host or LOOPBACK)
    try:
        token = None if text is None else Token(text)
        check_reach(host or LOOPBACK, token, what, f"--{prefix}token-file")
    except ValueError as fault:
        error(f"argument --{prefix}{'host' if text is None else 'token'}: {fault}")
    return token


def secret_in(path: str) -> str:
    """The contents of a file, stripped of blanks. Raises ArgumentTypeError."""
    shown = shortened(repr(path), 40)
    try:
        secret = Path(path).read_text(encoding="utf-8").strip()
    except (OSError, ValueError) as fault:
        raise argparse.ArgumentTypeError(f"{shown} cannot be read: {why(fault)}") from None
    if not secret:
        raise argparse.ArgumentTypeError(f"{shown} is empty, expected a secret")
    return secret
