"""The pages of commands and KRC4 messages, from the tables in protocol/ and dialogues that were held."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from importlib.resources import files
from typing import NamedTuple

from iiwa_sim.check import connections, lines, motion, numbers
from iiwa_sim.client import Iiwa, Krc4
from iiwa_sim.dialect.krc4.table import Command as Message
from iiwa_sim.dialect.krc4.table import load_krc4_table
from iiwa_sim.dialect.wire.command import Command, Quantity
from iiwa_sim.dialect.wire.error_codes import load_error_codes
from iiwa_sim.dialect.wire.table_file import load_table
from iiwa_sim.transcript.lines import read
from tools.pages import dialogues, refusals
from tools.pages.dialogues import Turn
from tools.pages.refusals import Refusal
from tools.requirements import REQUIREMENTS

JOINTS = 7
"""Joints of the robot of which the page of the backdoor tells."""
PROBES = (*lines.PROBES, *numbers.PROBES, *connections.PROBES, *motion.PROBES)


class Page(NamedTuple):
    """A page of the site."""

    path: str
    """Path in the site, below its root."""
    text: str


def slug(name: str) -> str:
    """The name of a command's file."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def pages() -> list[Page]:
    """All of them, with a page of contents for each protocol."""
    return [*_iiwa(), *_krc4(), *_backdoor()]


def _iiwa() -> Iterable[Page]:
    commands = list(load_table("iiwa").commands.values())
    said = dialogues.held()
    with refusals.asker() as robot:
        for command in commands:
            page = _command(command, said, robot.refusals(refusals.lines(command)))
            yield Page(f"reference/commands/{slug(command.name)}.md", page)
    groups = {
        "Of the original protocol": [each for each in commands if not each.extension],
        "Extensions: a driver for the real robot does without": [each for each in commands if each.extension],
    }
    text = "# Commands\n\nThe text protocol, one line for each command and one for each reply. "
    text += "[How lines are written and read](../../protocol.md) holds for all of them.\n"
    for title, group in groups.items():
        text += f"\n## {title}\n\n| command | |\n|---|---|\n"
        text += "".join(f"| [`{each.name}`]({slug(each.name)}.md) | {each.summary} |\n" for each in group)
    yield Page("reference/commands/index.md", text)


def _command(command: Command, said: Sequence[Sequence[Turn]], refused: Sequence[Refusal]) -> str:
    kind = "An extension: the original does not know it." if command.extension else ""
    parts = [
        f"# {command.name}",
        f"{command.summary} {kind}".strip(),
        f"```\n{_line(command)}\n```",
        _quantities((*command.parameters, *command.optional), {each.name for each in command.optional}),
        _reply(command),
        f"It enters the mode `{command.mode}`." if command.mode != "any" else "",
        f"## A dialogue\n\n```\n{dialogues.text(dialogues.example(said, command.name))}\n```",
        _refusals(dialogues.refusals(said, command.name), refused),
        _original(command),
        _requirements(command.requirements),
        _method(Iiwa, command.name.replace(" ", "_")),
    ]
    return _joined(parts)


def _line(command: Command) -> str:
    phrase = [command.phrase.upper()] if command.phrase else []
    optional = [f"({each.name})" for each in command.optional]
    takes = " ".join([*phrase, *(each.name for each in command.parameters), *optional])
    return f"{command.name} : {takes}" if takes else command.name


def _quantities(quantities: Sequence[Quantity], optional: Iterable[str] = ()) -> str:
    if not quantities:
        return ""
    rows = [
        f"| `{each.name}` | {'' if each.unit == '1' else each.unit} | {each.range} | {each.meaning}"
        f"{' (may be left out)' if each.name in optional else ''} |"
        for each in quantities
    ]
    return "\n".join(["| | unit | range | |", "|---|---|---|---|", *rows])


def _reply(command: Command) -> str:
    if command.reply_words:
        return f"Reply: {', '.join(f'`{word}`' for word in command.reply_words)}, or `error`."
    if command.reply_list is not None:
        return f"Reply: any number of `{command.reply_list.name}` ({command.reply_list.meaning}), or `error`."
    if command.reply_values:
        names = " ".join(each.name for each in command.reply_values)
        return f"Reply: `{names}`, or `error`.\n\n{_quantities(command.reply_values)}"
    return "Reply: a line of words, or `error`."


def _refusals(found: Sequence[tuple[str, str]], asked: Sequence[Refusal] = ()) -> str:
    """Refusals of the dialogues, and of what was asked besides for codes that these have not."""
    shown = {told.partition(" ")[0] for _, told in found}
    rows = [("", line, told) for line, told in dict(found).items()]
    rows += [
        (each.situation, each.line, each.told)
        for each in asked
        if each.situation or str(each.code) not in shown
    ]
    if not rows:
        return ""
    rows.sort(key=lambda row: row[2].split()[0].zfill(4))
    table = [f"| {situation} | `{line}` | {_linked(told)} |" for situation, line, told in rows]
    return "\n".join(["## Refusals", "", "| | said | code and reason |", "|---|---|---|", *table])


def _linked(told: str) -> str:
    """A reason that begins with its code, which leads to the page of errors."""
    code, _, reason = told.partition(" ")
    known = code.isdecimal() and int(code) in load_error_codes()
    return f"[{code}](../errors.md#{code}) {reason}" if known else told


def _original(command: Command) -> str:
    named = re.compile(rf"`?\b{re.escape(command.name)}\b")
    rows = [
        f"| {each.event} | {each.original} | {each.ours} |"
        for each in PROBES
        if each.ours and named.search(each.event)
    ]
    if not rows:
        return ""
    return "\n".join(
        ["## Other than the original", "", "| | the original | iiwa-sim |", "|---|---|---|", *rows]
    )


def _requirements(names: Sequence[str]) -> str:
    if not names:
        return ""
    told = "".join(f"- {name}: {REQUIREMENTS[name].says}\n" for name in names)
    return f"## Requirements\n\n{told}\nWhich tests show them to hold: [Requirements](../../requirements.md)."


def _krc4() -> Iterable[Page]:
    messages = load_krc4_table().commands.values()
    said = dialogues.held("krc4")
    with refusals.krc4_asker() as robot:
        for message in messages:
            page = _message(message, said, robot.refusals(refusals.messages(message)))
            yield Page(f"reference/messages/{slug(message.tag)}.md", page)
    rows = [f"| [`{each.tag}`]({slug(each.tag)}.md) | {each.id} | {each.summary} |" for each in messages]
    head = ["# KRC4 messages", "", "How they are written and read: [KRC4 messages](../../krc4.md).", ""]
    yield Page("reference/messages/index.md", "\n".join([*head, "| | id | |", "|---|---|---|", *rows, ""]))


def _message(message: Message, said: Sequence[Sequence[Turn]], refused: Sequence[Refusal]) -> str:
    rows = [(register, "request", meaning) for register, meaning in message.inputs.items()]
    rows += [(register, "reply", meaning) for register, meaning in message.outputs.items()]
    if message.joints:
        way = "request" if message.joints == "input" else "reply"
        rows.append(("R0 ...", way, "joint positions of all axes, deg"))
    told = [f"| `{register}` | {way} | {meaning} |" for register, way, meaning in rows]
    codes = {each.code for each in refused}  # replies in the transcripts have no reasons
    others = dialogues.refused_messages(said, message.tag)
    parts = [
        f"# {message.tag}",
        f"{message.summary} In `I1` it is {message.id}.",
        "\n".join(["| | in the | |", "|---|---|---|", *told]) if told else "",
        "## A dialogue",
        "In the [short form](../../krc4.md#recorded-replayed-drawn): values that are 0 are left out.",
        f"```\n{dialogues.text(dialogues.example(said, message.tag))}\n```",
        _refusals([row for row in others if int(row[1].split()[0]) not in codes], refused),
        _requirements(message.requirements),
        _method(Krc4, message.tag.lower()),
    ]
    return _joined(parts)


def _backdoor() -> Iterable[Page]:
    commands = list(load_table("backdoor", JOINTS).commands.values())
    name = "transcripts/backdoor/backdoor.txt"
    transcript = read(name, files("iiwa_sim.protocol").joinpath(name).read_text("utf-8"))
    said = [dialogues.spoken(transcript)]
    known = {turn.command for turn in said[0]}
    said.append(dialogues.asked_of_the_backdoor(each.name for each in commands if each.name not in known))
    for command in commands:
        parts = [
            f"# {command.name}",
            command.summary,
            f"```\n{_line(command)}\n```",
            _quantities(command.parameters),
            _reply(command).replace("`error`", "`error CODE REASON`"),
            f"## A dialogue\n\n```\n{dialogues.text(dialogues.example(said, command.name))}\n```",
            _refusals(dialogues.refused_lines(said, command.name)),
        ]
        yield Page(f"reference/bench/{slug(command.name)}.md", _joined(parts))
    rows = [f"| [`{each.name}`]({slug(each.name)}.md) | {each.summary} |" for each in commands]
    head = ["# Commands of the backdoor", "", "What they are for: [The backdoor](../../backdoor.md).", ""]
    yield Page("reference/bench/index.md", "\n".join([*head, "| | |", "|---|---|", *rows, ""]))


def _method(client: type, name: str) -> str:
    method = f"{client.__name__}.{name}"
    return f"In Python: [`{method}`][iiwa_sim.client.{method}]." if hasattr(client, name) else ""


def _joined(parts: Iterable[str]) -> str:
    return "\n\n".join(part for part in parts if part) + "\n"
