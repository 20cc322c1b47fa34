"""Options as environment variables, for containers that get variables but no arguments.

One rule for all: `--log-level debug` is IIWA_SIM_LOG_LEVEL=debug, `--strict` is IIWA_SIM_STRICT=1; values of
a repeatable option are separated by commas. The command line takes precedence; an empty variable counts as
unset.
"""

import argparse
from collections.abc import Mapping

from iiwa_sim.cli.parsing import Parser
from iiwa_sim.wording import shortened

PREFIX = "IIWA_SIM_"
SWITCH = {"1": True, "true": True, "0": False, "false": False}
RULE = (
    f"Each option can also come as an environment variable: --clock fast as {PREFIX}CLOCK=fast, --strict as "
    f"{PREFIX}STRICT=1 (or true; 0, false), CELL.toml as {PREFIX}CELL; commas stand between what can be "
    "repeated. The command line comes before the environment."
)

_ONLY_ARGUMENTS = ("help", "version")
_LONGEST_SHOWN = 40
_SERVICE_LINKS = (f"{PREFIX}SERVICE_", f"{PREFIX}PORT_")
_SERVICE_PORT = f"{PREFIX}PORT"


def variable(action: argparse.Action) -> str | None:
    """The name of the variable for an option; None for --help and --version."""
    return None if action.dest in _ONLY_ARGUMENTS else f"{PREFIX}{action.dest.upper()}"


def read_environment(parser: Parser, environment: Mapping[str, str]) -> argparse.Namespace:
    """The options in the environment, as a namespace for `parse_args` to start from.

    A malformed value ends the program with one line that names the variable, and exit code 2.
    """
    found = argparse.Namespace()
    for action in parser.options:
        name = variable(action)
        text = environment.get(name or "", "")
        if name is None or not text or _is_service_link(name, text):
            continue
        try:
            value = value_of(action, text)
        except argparse.ArgumentTypeError as fault:
            parser.error(f"{name}: {fault}")
        if action.option_strings:
            setattr(found, action.dest, value)
        else:  # argparse sets a positional argument that is not given to its default
            parser.set_defaults(**{action.dest: value})
    return found


def unknown_variables(parser: Parser, environment: Mapping[str, str]) -> list[str]:
    """Names that begin like those of options but are none."""
    known = {variable(action) for action in parser.options}
    return sorted(
        name
        for name, text in environment.items()
        if name.startswith(PREFIX) and name not in known and not _is_service_link(name, text)
    )


def _is_service_link(name: str, text: str) -> bool:
    """Whether Kubernetes sets this variable for a Service named iiwa-sim, or Docker for a link.

    These are IIWA_SIM_SERVICE_HOST, IIWA_SIM_PORT_30000_TCP_ADDR and the like, and
    IIWA_SIM_PORT=tcp://10.0.0.7:30000.
    """
    return name.startswith(_SERVICE_LINKS) or (name == _SERVICE_PORT and "://" in text)


def value_of(action: argparse.Action, text: str) -> object:
    """The value of an option from a text. Raises ArgumentTypeError."""
    if action.nargs == 0:
        return _switched(text)
    if isinstance(action, argparse._AppendAction):
        return [_converted(action, each) for each in text.split(",")]
    return _converted(action, text)


def _switched(text: str) -> bool:
    if text.lower() not in SWITCH:
        raise argparse.ArgumentTypeError(f"{_shown(text)}: expected {', '.join(SWITCH)}")
    return SWITCH[text.lower()]


def _converted(action: argparse.Action, text: str) -> object:
    value: object = text
    if callable(action.type):
        try:
            value = action.type(text)
        except ValueError:  # raised by int
            raise argparse.ArgumentTypeError(f"{_shown(text)}: expected a whole number") from None
    if action.choices is not None and value not in action.choices:
        expected = ", ".join(map(str, action.choices))
        raise argparse.ArgumentTypeError(f"{_shown(text)}: expected {expected}")
    return value


def _shown(text: str) -> str:
    return shortened(repr(text), _LONGEST_SHOWN)
