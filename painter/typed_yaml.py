"""Reads plain YAML data into dataclasses, with errors that name the field.

cattrs builds the values. This module makes it strict (cattrs would read a number from
text) and turns its tree of errors into one line: the first one with its field.
"""

import dataclasses
import enum
import re
import typing
from collections.abc import Callable
from typing import Any, TypeVar

import cattrs
import yaml
from cattrs.cols import list_structure_factory
from cattrs.errors import IterableValidationNote
from cattrs.gen import make_dict_structure_fn, make_mapping_structure_fn

T = TypeVar("T")

_EXPECTED = {
    float: "a number",
    int: "a whole number",
    str: "text",
    bool: "true or false",
}
# PyYAML reads 1e-5 (no point) and 1.5e5 (no sign) as text; YAML 1.2 does not.
_EXPONENT = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+")
CONVERTER = cattrs.Converter()
"""Builds the values; a module may register how further types are read."""


class _StrictLoader(yaml.SafeLoader):
    """Refuses a key that stands twice, of which PyYAML would take the last."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        """Returns the mapping of a node."""
        seen = set()
        for key, _ in node.value:
            if key.value in seen:
                raise yaml.constructor.ConstructorError(
                    problem=f"{key.value} stands twice", problem_mark=key.start_mark
                )
            seen.add(str(key.value))
        return super().construct_mapping(node, deep)


def load_yaml(text: str) -> Any:
    """Returns the data of a YAML text; raises yaml.YAMLError, also for a double key."""
    return yaml.load(text, _StrictLoader)


def read_typed(schema: type[T], data: object) -> T:
    """Makes a `schema` of YAML data.

    Args:
        schema: A dataclass whose fields are numbers, text, enums of text, dataclasses,
            or lists or dictionaries of these.
        data: What the YAML reader returned.

    Returns:
        The value; missing fields have their defaults.

    Raises:
        ValueError: A field is unknown, missing or of another type; names the field, the
            value and what is expected.
    """
    try:
        return CONVERTER.structure(data, schema)
    except (cattrs.BaseValidationError, ValueError) as error:
        raise ValueError(_describe(error)) from None


def _is_record(kind: Any) -> bool:
    return dataclasses.is_dataclass(kind) or typing.get_origin(kind) is dict


@CONVERTER.register_structure_hook_factory(_is_record)
def _record_reader(kind: Any) -> Callable[[object, Any], Any]:
    build: Callable[[Any, Any], Any]
    if dataclasses.is_dataclass(kind):
        build = make_dict_structure_fn(
            typing.cast(type[Any], kind), CONVERTER, _cattrs_forbid_extra_keys=True
        )
    else:
        build = make_mapping_structure_fn(kind, CONVERTER)

    def read(data: object, _: Any) -> Any:
        if data is None:  # A key with nothing behind it.
            data = {}
        if not isinstance(data, dict):
            raise ValueError(f"must have fields, got {data!r}.")
        return build(data, kind)

    return read


def _is_list(kind: Any) -> bool:
    return typing.get_origin(kind) is list


@CONVERTER.register_structure_hook_factory(_is_list)
def _list_reader(kind: Any) -> Callable[[object, Any], Any]:
    build = list_structure_factory(kind, CONVERTER)

    def read(data: object, _: Any) -> Any:
        if not isinstance(data, list):
            raise ValueError(f"must be a list, got {data!r}.")
        return build(data, kind)

    return read


def _read_scalar(data: object, kind: type) -> Any:
    if kind is float and isinstance(data, str) and _EXPONENT.fullmatch(data):
        return float(data)
    fits = isinstance(data, (int, float) if kind is float else kind)
    if not fits or (isinstance(data, bool) and kind is not bool):
        raise ValueError(f"must be {_EXPECTED[kind]}, got {data!r}.")
    return kind(data)


def _read_enum(data: object, kind: type[enum.StrEnum]) -> enum.StrEnum:
    if not isinstance(data, str) or data not in list(kind):
        raise ValueError(f"must be one of {', '.join(kind)}; got {data!r}.")
    return kind(data)


for _kind in _EXPECTED:
    CONVERTER.register_structure_hook(_kind, _read_scalar)
CONVERTER.register_structure_hook(enum.StrEnum, _read_enum)


def _describe(error: BaseException, field: str = "") -> str:
    """Returns the first error of cattrs' tree as one line that names the field."""
    if isinstance(error, cattrs.BaseValidationError):
        first = error.exceptions[0]
        # cattrs notes where in the data an error happened: a field, or a key.
        for note in getattr(first, "__notes__", ()):
            if isinstance(note, IterableValidationNote):
                is_item = isinstance(note.index, int)
                name = f"[{note.index}]" if is_item else f".{note.index}"
            else:
                name = f".{note.name}"
            field = (field + name).removeprefix(".")
        return _describe(first, field)
    if isinstance(error, cattrs.ForbiddenExtraKeysError):
        known = ", ".join(f.name for f in dataclasses.fields(error.cl))
        extra = min(error.extra_fields)
        name = f"{field}.{extra}" if field else extra
        return f"{name} is unknown; known are: {known}."
    if isinstance(error, KeyError):
        return f"{field} is missing."
    return f"{field or 'file'} {error}"
