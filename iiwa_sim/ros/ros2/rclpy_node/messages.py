"""Messages of rclpy from dicts and as dicts, and their classes by name."""

import array
import importlib
from typing import Any


def class_of(name: str) -> Any:
    """The class of package/msg/Type, package/srv/Type or package/action/Type; None where it is not
    installed, or has no type support that fits."""
    package, kind, own = name.split("/")
    support = importlib.import_module("rclpy.type_support")
    unfit = importlib.import_module("rosidl_generator_py.import_type_support_impl").UnsupportedTypeSupport
    try:
        found = getattr(importlib.import_module(f"{package}.{kind}"), own)
        support.check_for_type_support(found)
    except (ImportError, AttributeError, unfit):
        return None
    return found


def fill(message: Any, told: dict[str, Any]) -> Any:
    """Put a dict into a message; raises for what does not fit."""
    types = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for name, value in told.items():
        kind = types[name]
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            element = kind.value_type
            cls = getattr(importlib.import_module(".".join(element.namespaces)), element.name)
            setattr(message, name, [fill(cls(), each) for each in value])
        elif getattr(kind, "typename", "") == "octet":
            setattr(message, name, bytes([value]))
        else:
            setattr(message, name, value)
    return message


def plain(value: Any) -> Any:
    """A message as dicts, lists and numbers."""
    if hasattr(value, "get_fields_and_field_types"):
        kinds = value.get_fields_and_field_types()
        return {
            name: meant(getattr(value, name)) if kind == "float" else plain(getattr(value, name))
            for name, kind in kinds.items()
        }
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, array.array) and value.typecode == "f":
        return [meant(each) for each in value]
    if isinstance(value, array.array) or hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value


def meant(value: float) -> float:
    """The shortest decimal that a float32 stands for: 0.1, not 0.10000000149, which may exceed a limit."""
    return float(str(importlib.import_module("numpy").float32(value)))
