"""The classes of the types beside this package, made when a tool of ROS imports them.

Needs nothing but genpy, so that it works in the Python that ROS is installed for.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from genmsg import MsgContext
from genmsg.gentools import compute_md5
from genmsg.msg_loader import load_msg_from_string, load_srv_from_string
from genpy.dynamic import generate_dynamic

PACKAGES = Path(__file__).parents[3]
HALVES = ("Request", "Response")


def messages(package: str) -> dict[str, Any]:
    """The classes of a package's messages, by name without package."""
    found = texts("msg")
    made = classes_of(found, [name for name in found if name.startswith(f"{package}/")])
    return {name.split("/")[1]: each for name, each in made.items()}


def services(package: str) -> dict[str, Any]:
    """The classes of a package's services, of their requests and of their responses."""
    found = {name: text for name, text in texts("srv").items() if name.startswith(f"{package}/")}
    halves = {
        name + half: part
        for name, text in found.items()
        for half, part in zip(HALVES, text.split("---\n"))  # noqa: B905  # Python 3.8
    }
    made = classes_of({**texts("msg"), **halves}, list(halves))
    context = _context()
    classes = {}
    for name, text in found.items():
        request, response = (made[name + half] for half in HALVES)
        members = {
            "_type": name,
            "_md5sum": compute_md5(context, load_srv_from_string(context, text, name)),
            "_request_class": request,
            "_response_class": response,
        }
        short = name.split("/")[1]
        classes[short] = type(short, (), members)
        classes[f"{short}Request"], classes[f"{short}Response"] = request, response
    return classes


def texts(kind: str) -> dict[str, str]:
    """All definitions of messages (msg) or services (srv), by name with package."""
    paths = sorted(PACKAGES.glob(f"*/{kind}/*.{kind}"))
    return {f"{path.parts[-3]}/{path.stem}": path.read_text() for path in paths}


def _context() -> MsgContext:
    context = MsgContext.create_default()
    for name, text in texts("msg").items():
        context.register(name, load_msg_from_string(context, text, name))
    return context


def classes_of(definitions: dict[str, str], wanted: list[str]) -> dict[str, Any]:
    """The classes of the wanted messages, by name with package."""
    first, *others = definitions
    sections = [definitions[first], *(f"MSG: {name}\n{definitions[name]}" for name in others)]
    made = generate_dynamic(first, ("\n" + 80 * "=" + "\n").join(sections))
    for name in wanted:  # the names that tools show
        made[name].__name__ = name.split("/")[1]
    return {name: made[name] for name in wanted}
