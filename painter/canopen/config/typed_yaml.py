"""Reads plain YAML data into dataclasses, with errors that name the field."""

import dataclasses
import enum
import types
import typing
from typing import Any, TypeVar

T = TypeVar("T")

_WORDS = {
    float: "a number",
    int: "a whole number",
    str: "a word",
    bool: "true or false",
}


def read_typed(schema: type[T], data: object, where: str = "") -> T:
    """Makes a `schema` of YAML data.

    Args:
        schema: A dataclass whose fields are numbers, words, enums, dataclasses, lists
            and dictionaries of these, or one of them or None.
        data: What the YAML reader returned.
        where: Name of the field that holds the data; empty at the top.

    Returns:
        The value; missing fields have their defaults.

    Raises:
        ValueError: A field is unknown, missing or of another type; names it.
    """
    value: T = _read(schema, data, where)
    return value


def _read(schema: Any, data: object, where: str) -> Any:
    origin = typing.get_origin(schema)
    if origin in (types.UnionType, typing.Union):
        if data is None:
            return None
        (kind,) = (k for k in typing.get_args(schema) if k is not types.NoneType)
        return _read(kind, data, where)
    if dataclasses.is_dataclass(schema):
        return _read_fields(schema, data, where)
    if origin is dict:
        if not isinstance(data, dict):
            raise ValueError(f"{where} must have fields, got {data!r}.")
        _, kind = typing.get_args(schema)
        return {str(k): _read(kind, v, _join(where, k)) for k, v in data.items()}
    if origin is list:
        if not isinstance(data, list):
            raise ValueError(f"{where} must be a list, got {data!r}.")
        (kind,) = typing.get_args(schema)
        return [_read(kind, value, f"{where}[{i}]") for i, value in enumerate(data)]
    if isinstance(schema, type) and issubclass(schema, enum.StrEnum):
        if not isinstance(data, str) or data not in list(schema):
            known = ", ".join(schema)
            raise ValueError(f"{where} must be one of {known}; got {data!r}.")
        return schema(data)
    fits = isinstance(data, (int, float) if schema is float else schema)
    if not fits or (isinstance(data, bool) and schema is not bool):
        raise ValueError(f"{where} must be {_WORDS[schema]}, got {data!r}.")
    return float(data) if isinstance(data, int) and schema is float else data


def _read_fields(schema: Any, data: object, where: str) -> Any:
    if data is None:
        data = {}
    if not isinstance(data, dict):
        raise ValueError(f"{where or 'file'} must have fields, got {data!r}.")
    fields = {field.name: field for field in dataclasses.fields(schema)}
    values = {}
    for key, value in data.items():
        if key not in fields:
            known = ", ".join(fields)
            raise ValueError(f"{_join(where, key)} is unknown; known are: {known}.")
        values[str(key)] = _read(fields[key].type, value, _join(where, key))
    for name, field in fields.items():
        required = (
            field.default is dataclasses.MISSING
            and field.default_factory is dataclasses.MISSING
        )
        if required and name not in values:
            raise ValueError(f"{_join(where, name)} is missing.")
    return schema(**values)


def _join(where: str, key: object) -> str:
    return f"{where}.{key}" if where else str(key)
