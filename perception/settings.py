"""Settings: fields with unit, bounds and source, and the one check of them.

A config is a plain mutable dataclass whose fields are made by `setting`. Unit, bounds
and source of a value stand there; what the value does stands in the class's docstring
under "Attributes:". `validate` checks a config and all configs in it, and `describe`
lists what a reference of settings needs. The standard library alone.
"""

import copy
import dataclasses
import inspect
import math
import re
from collections.abc import Iterator
from numbers import Real
from typing import Any, TypeVar, get_args, get_origin

T = TypeVar("T")
Conflict = tuple[str, str, object]
"""A field that does not fit to others: its name, what it must be, its value."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rule:
    """What a setting may be. Of a list, each element; numbers are always finite.

    Attributes:
        unit: SI or as the field's name says; "1" of numbers without one.
        above: Lower bound that is not allowed itself.
        least: Lower bound that is.
        most: Upper bound that is.
        below: Upper bound that is not allowed itself.
        choices: The only values, if any are given.
        length: Of a list, the number of its elements.
        odd: Whether it must be an odd number.
        source: Where the default comes from: author, title, year, place in it.
    """

    unit: str = ""
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    below: float = math.inf
    choices: tuple[object, ...] = ()
    length: int | None = None
    odd: bool = False
    source: str = ""

    def allows(self, value: object) -> bool:
        """Tells whether the rule allows a value that is no list."""
        if self.choices:
            return value in self.choices
        if isinstance(value, bool) or not isinstance(value, Real):
            return not self.unit
        number = float(value)
        return (
            self.least <= number <= self.most
            and self.above < number < self.below
            and not (self.odd and number % 2.0 != 1.0)
        )

    def __str__(self) -> str:
        """Returns the bounds in words, e.g. "> 0 and <= 2.5 m/s"."""
        if self.choices:
            return f"one of {', '.join(map(str, self.choices))}"
        if math.isfinite(self.least) and math.isfinite(self.most):
            parts = [f"{self.least:g} to {self.most:g}"]
        else:
            values = self.above, self.least, self.most, self.below
            bounds = zip((">", ">=", "<=", "<"), values, strict=True)
            parts = [f"{sign} {x:g}" for sign, x in bounds if math.isfinite(x)]
        text = " and ".join(parts) or "finite"
        if self.unit not in ("", "1"):
            text += f" {self.unit}"
        return f"odd and {text}" if self.odd else text


def setting(default: T, unit: str = "", **rule: Any) -> T:
    """Makes the field of a config.

    Args:
        default: Value that the field has unless a file says otherwise; copied.
        unit: See `Rule`.
        rule: Further fields of `Rule`.

    Raises:
        TypeError: A number has no unit, or `Rule` has no such field.
    """
    metadata = {"rule": Rule(unit=unit, **rule)}
    if isinstance(default, bool | str):
        return dataclasses.field(default=default, metadata=metadata)
    if isinstance(default, Real):
        if not unit:
            raise TypeError(f'a number needs a unit, or "1", got {default!r} alone.')
        return dataclasses.field(default=default, metadata=metadata)
    return dataclasses.field(
        default_factory=lambda: copy.deepcopy(default), metadata=metadata
    )


def required(unit: str = "", **rule: Any) -> Any:
    """Makes the field of a config that has no default; see `setting`."""
    return dataclasses.field(metadata={"rule": Rule(unit=unit, **rule)})


def validate(config: Any, owner: str = "") -> None:
    """Checks all values of a config.

    Args:
        config: A dataclass with fields made by `setting`. If it has a method
            `conflicts() -> Iterator[Conflict]`, that checks fields against each other
            once each is within its bounds.
        owner: Name of the field that holds the config, for the message.

    Raises:
        ValueError: A value is out of bounds: "owner.field must be BOUND, got VALUE."
    """
    for problem in problems(config, owner):
        raise ValueError(problem)


def problems(config: Any, owner: str = "") -> Iterator[str]:
    """Yields what `validate` finds, a line each."""
    fits = True
    for field in dataclasses.fields(config):
        rule = field.metadata.get("rule", Rule())
        path = _join(owner, field.name)
        for problem in _value_problems(getattr(config, field.name), rule, path):
            fits = False
            yield problem
    if fits and hasattr(config, "conflicts"):
        for name, bound, value in config.conflicts():
            yield f"{_join(owner, name)} must be {bound}, got {value!r}."


def _value_problems(value: Any, rule: Rule, path: str) -> Iterator[str]:
    if dataclasses.is_dataclass(value):
        yield from problems(value, path)
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _value_problems(item, rule, f"{path}.{key}")
    elif isinstance(value, list | tuple):
        if rule.length not in (None, len(value)):
            yield f"{path} must be {rule.length} numbers, {rule}, got {value!r}."
        else:
            for i, item in enumerate(value):
                yield from _value_problems(item, rule, f"{path}[{i}]")
    elif not rule.allows(value):
        yield f"{path} must be {rule}, got {value!r}."


@dataclasses.dataclass(frozen=True)
class Description:
    """A setting as a reference shows it.

    Attributes:
        path: Dotted name from the top; "[]" follows the name of a list of configs.
        kind: Its type: a class, or a list of one.
        default: Its default.
        rule: Unit, bounds and source.
        text: What it does; of a config in the config, what that is.
    """

    path: str
    kind: Any
    default: Any
    rule: Rule
    text: str


def describe(config_type: type[Any], owner: str = "") -> Iterator[Description]:
    """Yields all settings of a config and of the configs in it, in order."""
    texts = _attribute_texts(config_type)
    for field in dataclasses.fields(config_type):
        path = _join(owner, field.name)
        is_list = get_origin(field.type) is list
        kind: Any = get_args(field.type)[0] if is_list else field.type
        has_fields = isinstance(kind, type) and dataclasses.is_dataclass(kind)
        text = texts.get(field.name, "")
        if has_fields and not text:
            text = (inspect.getdoc(kind) or "").partition("\n")[0]
        yield Description(
            path=path,
            kind=field.type,
            default=getattr(config_type(), field.name),
            rule=field.metadata.get("rule", Rule()),
            text=text,
        )
        if has_fields:
            yield from describe(kind, f"{path}[]" if is_list else path)


def _attribute_texts(config_type: type) -> dict[str, str]:
    """Reads "name: text" below "Attributes:" in the docstrings of a class."""
    texts = {}
    for base in reversed(config_type.__mro__):
        section = inspect.cleandoc(base.__doc__ or "").partition("\nAttributes:\n")[2]
        for name, text in re.findall(r"^ {4}(\w+): (.+(?:\n {5,}.+)*)", section, re.M):
            texts[name] = " ".join(text.split())
    return texts


def _join(owner: str, name: str) -> str:
    return f"{owner}.{name}" if owner else name
