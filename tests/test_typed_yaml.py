"""Typed YAML: what is read, and errors that name field, value and what is expected."""

import dataclasses
import enum

import pytest
import yaml

from painter.typed_yaml import load_yaml, read_typed


class Colour(enum.StrEnum):
    RED = "red"
    BLUE = "blue"


@dataclasses.dataclass(kw_only=True)
class Part:
    size: float
    count: int = 1
    colour: Colour = Colour.RED


@dataclasses.dataclass(kw_only=True)
class Whole:
    parts: dict[str, Part]
    name: str = "none"
    is_new: bool = False
    spare: Part = dataclasses.field(default_factory=lambda: Part(size=0.0))
    corners: list[list[float]] = dataclasses.field(default_factory=list)


def test_values_have_the_types_of_their_fields():
    whole = read_typed(
        Whole,
        {"parts": {"a": {"size": 2, "colour": "blue"}}, "name": "x", "is_new": True},
    )
    assert whole == Whole(
        parts={"a": Part(size=2.0, colour=Colour.BLUE)}, name="x", is_new=True
    )
    assert isinstance(whole.parts["a"].size, float)
    assert isinstance(whole.parts["a"].colour, Colour)


def test_numbers_with_an_exponent_are_numbers():
    """YAML 1.2, 10.3.2; PyYAML reads 1.1, where 1e-5 and 1.5e5 are text."""
    data = yaml.safe_load("{parts: {a: {size: 1e-5}}, corners: [[1e3, -2E+1, 1.5e5]]}")
    whole = read_typed(Whole, data)
    assert whole.parts["a"].size == 1e-5
    assert whole.corners == [[1000.0, -20.0, 150000.0]]


def test_a_key_without_a_value_has_no_fields():
    assert read_typed(Whole, {"parts": None}).parts == {}


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (3, "file must have fields, got 3."),
        ({}, "parts is missing."),
        ({"parts": [1]}, "parts must have fields, got [1]."),
        ({"parts": {"a": 5}}, "parts.a must have fields, got 5."),
        ({"parts": {"a": {}}}, "parts.a.size is missing."),
        ({"parts": {"a": {"size": "2"}}}, "parts.a.size must be a number, got '2'."),
        ({"parts": {"a": {"size": True}}}, "parts.a.size must be a number, got True."),
        (
            {"parts": {"a": {"size": 1, "count": 1.5}}},
            "parts.a.count must be a whole number, got 1.5.",
        ),
        (
            {"parts": {"a": {"size": 1, "colour": "green"}}},
            "parts.a.colour must be one of red, blue; got 'green'.",
        ),
        (
            {"parts": {"a": {"size": 1, "shape": 1}}},
            "parts.a.shape is unknown; known are: size, count, colour.",
        ),
        ({"parts": {}, "name": 7}, "name must be text, got 7."),
        ({"parts": {}, "is_new": 1}, "is_new must be true or false, got 1."),
        ({"parts": {}, "spare": None}, "spare.size is missing."),
        ({"parts": {}, "corners": "ab"}, "corners must be a list, got 'ab'."),
        ({"parts": {}, "corners": [1]}, "corners[0] must be a list, got 1."),
        (
            {"parts": {}, "corners": [[0, 0], [1, "b"]]},
            "corners[1][1] must be a number, got 'b'.",
        ),
        (
            {"parts": {"a": {"size": "1e-"}}},
            "parts.a.size must be a number, got '1e-'.",
        ),
        (
            {"parts": {}, "other": 1},
            "other is unknown; known are: parts, name, is_new, spare, corners.",
        ),
    ],
)
def test_an_error_names_field_value_and_what_is_expected(data, message):
    with pytest.raises(ValueError) as caught:
        read_typed(Whole, data)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    "text", ["a: 1\nb: 2\na: 3\n", "top:\n  a: 1\n  a: 1\n", "- {x: 1, x: 2}\n"]
)
def test_a_key_that_stands_twice_is_refused_with_its_place(text):
    with pytest.raises(yaml.YAMLError, match=r"(?s)(a|x) stands twice.*line \d"):
        load_yaml(text)


def test_merged_keys_may_be_overridden():
    data = load_yaml("base: &base {a: 1, b: 2}\nown: {<<: *base, b: 3}\n")
    assert data["own"] == {"a": 1, "b": 3}
