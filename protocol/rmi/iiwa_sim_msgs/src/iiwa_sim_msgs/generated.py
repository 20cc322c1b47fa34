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
    texts = _texts("msg")
    made = _made(texts, [name for name in texts if name.startswith(f"{package}/")])
    return {name.split("/")[1]: each for name, each in made.items()}


def services(package: str) -> dict[str, Any]:
    """The classes of a package's services, of their requests and of their responses."""
    texts = {name: text for name, text in _texts("srv").items() if name.startswith(f"{package}/")}
    halves = {
        name + half: part
        for name, text in texts.items()
        for half, part in zip(HALVES, text.split("---\n"))  # noqa: B905  # Python 3.8
    }
    made = _made({**_texts("msg"), **halves}, list(halves))
    context = _context()
    classes = {}
    for name, text in texts.items():
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


def _texts(kind: str) -> dict[str, str]:
    """All definitions of messages (msg) or services (srv), by name with package."""
    paths = sorted(PACKAGES.glob(f"*/{kind}/*.{kind}"))
    return {f"{path.parts[-3]}/{path.stem}": path.read_text() for path in paths}


def _context() -> MsgContext:
    context = MsgContext.create_default()
    for name, text in _texts("msg").items():
        context.register(name, load_msg_from_string(context, text, name))
    return context


def _made(texts: dict[str, str], wanted: list[str]) -> dict[str, Any]:
    first, *others = texts
    sections = [texts[first], *(f"MSG: {name}\n{texts[name]}" for name in others)]
    made = generate_dynamic(first, ("\n" + 80 * "=" + "\n").join(sections))
    for name in wanted:  # the names that tools show
        made[name].__name__ = name.split("/")[1]
    return {name: made[name] for name in wanted}
