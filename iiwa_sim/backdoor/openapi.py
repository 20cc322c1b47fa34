"""The description of the backdoor over HTTP, as OpenAPI 3.1, written from the table."""

import json
from collections.abc import Sequence
from importlib import metadata
from importlib.resources import files

from iiwa_sim.backdoor.json_lines import Field, fields
from iiwa_sim.dialect.wire.command import Command, Quantity

COMMANDS = "/backdoor/"
"""What the path of each command begins with."""
_STATE = "#/components/schemas/State"
_ERRORS = {
    "400": "the body is not what the command takes; nothing has changed",
    "403": "a web page asks, or one asks by a name that this machine need not have",
    "409": "the robot refuses it as it is now; nothing has changed",
}


def description(commands: Sequence[Command], *, with_token: bool) -> dict[str, object]:
    """The description of the commands that have a path; with or without a token."""
    paths = {path_of(each): {"post": _post(each, with_token)} for each in commands}
    schema = files("iiwa_sim.protocol").joinpath("status.schema.json").read_text()
    state = json.loads(schema.replace("#/$defs/", f"{_STATE}/$defs/"))
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "iiwa-sim: the backdoor of a simulated robot",
            "version": metadata.version("iiwa-sim"),
            "description": "What a test bench does to robot, cell, time and wire: docs/backdoor.md.",
        },
        "paths": paths
        | {
            "/state": {
                "get": _get("state", "The robot's state, as on its port.", {"$ref": _STATE}, with_token)
            },
            "/dialogue": {
                "get": _get("dialogue", "The newest lines said in all dialects.", _DIALOGUE, with_token)
            },
            "/healthz": {"get": _get("healthz", "Whether the robot's process answers.", _HEALTH, False)},
        },
        "components": {
            "schemas": {"Error": _ERROR, "State": state},
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
        },
    }


def path_of(command: Command) -> str:
    """The path of a command."""
    return f"{COMMANDS}{command.name.replace(' ', '-')}"


def _post(command: Command, with_token: bool) -> dict[str, object]:
    properties = {each.name: _schema(each) for each in fields(command.parameters)}
    for name in command.phrases:
        properties[name] = {"type": "string", "description": f"the {name}, printable ASCII"}
    body = {
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }
    reply = {"type": "object", "properties": {"reply": _reply(command)}, "required": ["reply"]}
    return {
        "operationId": command.name.replace(" ", "_"),
        "summary": command.summary,
        **({"requestBody": {"required": True, "content": _json(body)}} if properties else {}),
        "responses": {"200": {"description": "carried out", "content": _json(reply)}, **_errors(with_token)},
        **_security(with_token),
    }


def _get(name: str, summary: str, schema: object, with_token: bool) -> dict[str, object]:
    return {
        "operationId": f"get_page_{name}",
        "summary": summary,
        "responses": {"200": {"description": summary, "content": _json(schema)}},
        **_security(with_token),
    }


def _errors(with_token: bool) -> dict[str, object]:
    told = _ERRORS | ({"401": "the token is missing or another one"} if with_token else {})
    content = _json({"$ref": "#/components/schemas/Error"})
    return {status: {"description": text, "content": content} for status, text in sorted(told.items())}


def _security(with_token: bool) -> dict[str, object]:
    return {"security": [{"token": []}]} if with_token else {}


def _reply(command: Command) -> dict[str, object]:
    if command.reply_values:
        names = [each.name for each in command.reply_values]
        properties = {each.name: _schema(Field(each.name, each, None)) for each in command.reply_values}
        return {"type": "object", "properties": properties, "required": names}
    if command.reply_list is not None:
        return {"type": "array", "items": _number(command.reply_list)}
    if command.reply_words:
        return {"enum": list(command.reply_words)}
    return {}


def _schema(field: Field) -> dict[str, object]:
    if field.length is None:
        return _number(field.quantity)
    return {
        "type": "array",
        "items": _number(field.quantity),
        "minItems": field.length,
        "maxItems": field.length,
    }


def _number(quantity: Quantity) -> dict[str, object]:
    unit = "" if quantity.unit == "1" else f" ({quantity.unit})"
    limits = {
        "minimum": quantity.minimum,
        "maximum": quantity.maximum,
        "exclusiveMinimum": quantity.above,
    }
    return {
        "type": "integer" if quantity.integer else "number",
        "description": f"{quantity.meaning}{unit}",
        **{key: value for key, value in limits.items() if value is not None},
    }


def _json(schema: object) -> dict[str, object]:
    return {"application/json": {"schema": schema}}


_ERROR = {
    "type": "object",
    "properties": {
        "error": {
            "type": "object",
            "properties": {"code": {"type": "integer"}, "reason": {"type": "string"}},
            "required": ["code", "reason"],
        }
    },
    "required": ["error"],
}
_HEALTH = {"type": "object", "properties": {"ok": {"const": True}}, "required": ["ok"]}
_DIALOGUE = {
    "type": "object",
    "properties": {
        "forgotten": {"type": "integer", "minimum": 0, "description": "lines before these"},
        "lines": {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {
                    "time_s": {"type": "number", "description": "simulated time"},
                    "session": {"type": "string"},
                    "mark": {"enum": [">", "<", "#", "~"]},
                    "text": {"type": "string"},
                },
                "required": ["time_s", "session", "mark", "text"],
            },
        },
    },
    "required": ["forgotten", "lines"],
}
