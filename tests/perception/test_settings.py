"""Settings are checked by their fields' own metadata, and say what they are."""

import dataclasses
import enum
import math

import numpy as np
import pytest

from perception.settings import Rule, describe, problems, setting, validate


class Stop(enum.IntEnum):
    """Option codes."""

    RAMP = 1
    QUICK = 2


@dataclasses.dataclass(kw_only=True)
class Valve:
    """A valve.

    Attributes:
        delay: From trigger to flow.
    """

    delay: float = setting(0.02, "s", least=0.0, below=0.5)


@dataclasses.dataclass(kw_only=True)
class Gun:
    """A gun.

    Source: none.

    Attributes:
        speed: Along a stroke, of the nozzle
            alone; as planned: not as driven.
        window: Of the matcher.
        mode: How it is driven.
        color: Red, green and blue.
        stop: What it does at a stop.
        spare: Further valves.
        by_name: Valves by name.
    """

    speed: float = setting(0.6, "m/s", above=0.0, most=2.5, source="measured")
    window: int = setting(7, "px", least=1, most=51, odd=True)
    mode: str = setting("auto", choices=("auto", "hand"))
    color: list[float] = setting([0.1, 0.2, 0.3], "1", least=0.0, most=1.0, length=3)
    stop: int = setting(Stop.RAMP, "1", choices=tuple(Stop))
    is_on: bool = setting(True)
    valve: Valve = setting(Valve())
    spare: list[Valve] = setting([])
    by_name: dict[str, Valve] = setting({})

    def conflicts(self):
        if self.speed > 10.0 * self.valve.delay + 1.0:
            yield "speed", "<= 1 m/s and 10 valve.delay", self.speed


@dataclasses.dataclass(kw_only=True)
class FastGun(Gun):
    """A fast gun.

    Attributes:
        turbo: Whether it is faster.
    """

    speed: float = setting(0.7, "m/s", above=0.0)
    turbo: bool = setting(False)


def test_defaults_are_within_bounds_and_nobody_else_s():
    validate(Gun())
    Gun().color.append(1.0)
    Gun().valve.delay = 9.0
    assert Gun().color == [0.1, 0.2, 0.3]
    assert Gun().valve.delay == 0.02


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": 0.0}, "gun.speed must be > 0 and <= 2.5 m/s, got 0.0."),
        ({"speed": 2.6}, "gun.speed must be > 0 and <= 2.5 m/s, got 2.6."),
        ({"speed": math.nan}, "gun.speed must be > 0 and <= 2.5 m/s, got nan."),
        ({"speed": True}, "gun.speed must be > 0 and <= 2.5 m/s, got True."),
        ({"speed": "1"}, "gun.speed must be > 0 and <= 2.5 m/s, got '1'."),
        ({"window": 6}, "gun.window must be odd and 1 to 51 px, got 6."),
        ({"window": 53}, "gun.window must be odd and 1 to 51 px, got 53."),
        ({"mode": "foot"}, "gun.mode must be one of auto, hand, got 'foot'."),
        ({"stop": 3}, "gun.stop must be one of 1, 2, got 3."),
        ({"color": [1.0]}, "gun.color must be 3 numbers, 0 to 1, got [1.0]."),
        ({"color": [0.0, 1.0, 1.1]}, "gun.color[2] must be 0 to 1, got 1.1."),
        ({"valve": Valve(delay=0.5)}, "gun.valve.delay must be >= 0 and < 0.5 s, got "),
        ({"spare": [Valve(), Valve(delay=-1)]}, "gun.spare[1].delay must be >= 0 "),
        ({"by_name": {"a": Valve(delay=-1)}}, "gun.by_name.a.delay must be >= 0 and "),
        ({"speed": 1.3}, "gun.speed must be <= 1 m/s and 10 valve.delay, got 1.3."),
    ],
)
def test_a_value_out_of_bounds_is_named_with_bound_and_value(change, message):
    with pytest.raises(ValueError) as error:
        validate(Gun(**change), "gun")
    assert str(error.value).startswith(message)


@pytest.mark.parametrize(
    "change",
    [
        {"speed": 1},
        {"speed": np.float64(1.0)},
        {"window": np.int64(9)},
        {"valve": Valve(delay=0)},
        {"mode": "hand"},
        {"color": (0, 1, 0.5)},
        {"stop": 2},
    ],
)
def test_a_value_within_bounds_passes_unchanged(change):
    gun = Gun(**change)
    validate(gun)
    ((name, value),) = change.items()
    assert getattr(gun, name) is value


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_are_finite_even_without_bounds(value):
    assert not Rule(unit="m").allows(value)
    assert Rule(unit="m").allows(-1e300)


def test_all_problems_are_found_and_conflicts_only_among_sound_values():
    gun = Gun(speed=2.0, window=2, valve=Valve(delay=1.0))
    assert [line.split(" ")[0] for line in problems(gun)] == ["window", "valve.delay"]
    assert list(problems(Gun(speed=2.0))) != []


def test_a_number_needs_a_unit():
    with pytest.raises(TypeError, match="unit"):
        setting(1.0)
    with pytest.raises(TypeError, match="lest"):
        setting(1.0, "m", lest=0.0)


def test_settings_are_described_by_their_fields_and_docstring():
    found = {item.path: item for item in describe(Gun)}
    assert list(found) == [
        *("speed", "window", "mode", "color", "stop", "is_on", "valve", "valve.delay"),
        *("spare", "spare[].delay", "by_name"),
    ]
    speed = found["speed"]
    assert speed.text == (
        "Along a stroke, of the nozzle alone; as planned: not as driven."
    )
    assert (speed.kind, speed.default) == (float, 0.6)
    assert (speed.rule.unit, speed.rule.source) == ("m/s", "measured")
    assert str(speed.rule) == "> 0 and <= 2.5 m/s"
    assert found["valve"].text == "A valve."
    assert found["spare[].delay"].text == "From trigger to flow."
    assert found["is_on"].text == ""


def test_a_child_describes_what_it_inherits():
    found = {item.path: item for item in describe(FastGun, "gun")}
    assert found["gun.speed"].text.startswith("Along a stroke")
    assert found["gun.speed"].default == 0.7
    assert found["gun.turbo"].text == "Whether it is faster."
