"""Every parameter of every planner: read from the dataclasses that hold them."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import math
import pkgutil
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import pushplan
from pushplan.planners.registry import PLANNERS, POLICIES, make_planner, make_policy
from pushplan.world.checked_fields import Limits, OneOf

ROOMS = ("control", "gtsp", "motion", "planners")
_SETTINGS = re.compile(r"(Config|Parameters|Replanning)$")
_ITEM = re.compile(r"^    (\w+): (.*?)(?=^    \w+: |\Z)", re.MULTILINE | re.DOTALL)
_UNIT = re.compile(r"\s*\[([^\]\d][^\]]*|1 / [^\]]*)\]")


@dataclass(frozen=True)
class Parameter:
    """One field of a class of settings."""

    owner: type
    name: str
    unit: str
    default: str
    valid: str
    text: str


def classes() -> list[type]:
    """Classes of settings, and planners that hold theirs themselves."""
    found: dict[type, None] = {}
    for room in ROOMS:
        package = importlib.import_module(f"pushplan.{room}")
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            for name, value in vars(importlib.import_module(module.name)).items():
                if inspect.isclass(value) and value.__module__ == module.name:
                    if dataclasses.is_dataclass(value) and _SETTINGS.search(name):
                        found[value] = None
    for name in PLANNERS:
        owner = type(make_planner(name))
        if dataclasses.is_dataclass(owner) and any(_own_fields(owner)):
            found[owner] = None
    return sorted(found, key=lambda kind: (kind.__module__, kind.__name__))


def parameters(owner: type) -> list[Parameter]:
    """The fields of a class with their descriptions."""
    hints = get_type_hints(owner, include_extras=True)
    said = descriptions(owner)
    found = []
    for field in _own_fields(owner):
        text = said.get(field.name, "")
        unit = _UNIT.search(text)
        found.append(
            Parameter(
                owner=owner,
                name=field.name,
                unit="" if unit is None else unit[1],
                default=_default(field),
                valid=_valid(hints[field.name]),
                text=_UNIT.sub("", text, count=1) if unit else text,
            )
        )
    return found


def descriptions(owner: type) -> dict[str, str]:
    """Field -> what the section "Args" says, in the docstring of the class or of a base."""
    found: dict[str, str] = {}
    for kind in reversed(owner.__mro__):
        _, _, rest = inspect.cleandoc(kind.__doc__ or "").partition("\nArgs:\n")
        section = re.split(r"^\S", rest, maxsplit=1, flags=re.MULTILINE)[0]
        found |= {name: " ".join(text.split()) for name, text in _ITEM.findall(section)}
    return found


def users(owner: type) -> list[str]:
    """Planners and policies that are made with a class of settings."""
    found = []
    for table, make in ((PLANNERS, make_planner), (POLICIES, make_policy)):
        for name in table:
            made = make(name)
            if name not in found and owner in (type(made), *_types_in(made)):
                found.append(name)
    return found


def changes() -> dict[str, dict[str, str]]:
    """Planner or policy -> the values by which its config departs from the defaults of the class.

    The classes are told apart by `users`.
    """
    found = {}
    for table, make in ((PLANNERS, make_planner), (POLICIES, make_policy)):
        for name in table:
            made = make(name)
            config = getattr(getattr(made, "planner", made), "config", None)
            if dataclasses.is_dataclass(config):
                given = {
                    field.name: repr(value)
                    for field in _own_fields(type(config))
                    if (value := getattr(config, field.name)) != getattr(type(config)(), field.name)
                }
                if given:
                    found[name] = given
    return found


def _types_in(value: Any, depth: int = 3) -> Iterator[type]:
    """Types of what an object of ours holds, of what that holds, and so on."""
    for held in getattr(value, "__dict__", {}).values():
        if type(held).__module__.startswith(pushplan.__name__) and depth:
            yield type(held)
            yield from _types_in(held, depth - 1)


def _own_fields(owner: type) -> Iterator[dataclasses.Field[Any]]:
    """Fields that are values: what holds settings, and models that are plugged in, are not."""
    for field in dataclasses.fields(owner):
        if field.init and field.name not in ("config", "interaction", "network"):
            yield field


def _default(field: dataclasses.Field[Any]) -> str:
    if field.default is not dataclasses.MISSING:
        value = field.default
    elif field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    else:
        return "(required)"
    if dataclasses.is_dataclass(value):
        return f"{type(value).__name__}()"
    text = repr(value)
    return text if len(text) <= 40 else f"{type(value).__name__} of {len(value)}"


def _valid(hint: Any) -> str:
    optional = type(None) in get_args(hint)
    kinds = [one for one in get_args(hint) if one is not type(None)] if optional else [hint]
    text = " or ".join([*map(_one, kinds), *(["None"] if optional else [])])
    return text


def _one(hint: Any) -> str:
    base, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    for note in notes:
        if isinstance(note, OneOf):
            return ", ".join(note.valid)
        if isinstance(note, Limits):
            low = "" if note.low == -math.inf else f"{'>' if note.open_low else '≥'} {note.low:g}"
            high = "" if note.high == math.inf else f"≤ {note.high:g}"
            return f"{base.__name__} {' and '.join(part for part in (low, high) if part)}".strip()
    return getattr(base, "__name__", str(base))
