"""Every scenario and scene that ships loads; overrides and bad input are handled."""

import dataclasses
import math

import pytest
import yaml

from painter.config import Scenario, dump_scenario, load_scenario
from painter.errors import InputError
from painter.resources import models_path, named_scenarios

# DESIGN section 7.
NAMES = {"blank", "cubes", "obstacles", "random", "room", "terrace"}


def test_the_named_scenarios_are_there():
    assert set(named_scenarios()) >= NAMES


@pytest.mark.parametrize("name", named_scenarios())
def test_scenario_loads_under_its_own_name(name):
    assert load_scenario(name).name == name


@pytest.mark.parametrize("name", named_scenarios())
def test_scenario_names_a_scene_that_ships(name):
    scene = load_scenario(name).scene
    assert scene == "random" or models_path("scenes", f"{scene}.scene.yaml").is_file()


@pytest.mark.parametrize("name", named_scenarios())
def test_dumped_scenario_reads_back_the_same(name, tmp_path):
    scenario = load_scenario(name, ["random_seed=7", "raster.speed=0.5"])
    path = tmp_path / "scenario.yaml"
    path.write_text(dump_scenario(scenario))
    assert dump_scenario(load_scenario(str(path))) == dump_scenario(scenario)


def test_no_scenario_changes_the_shared_defaults():
    before = dump_scenario(Scenario())
    load_scenario("cubes", ["gun.tip.fan_width=0.4", "arm.encoder_bits=12"])
    assert dump_scenario(Scenario()) == before


def test_overrides_are_read_as_yaml_and_keep_their_neighbours():
    scenario = load_scenario(
        "cubes",
        [
            "raster.speed=0.5",
            "random_seed=3",
            "cycle.unattended=false",
            "wall_camera.mount_error_m=[0.001, 0, 0]",
            "arm.faults=[{time: 2.0, joint: 3}]",
        ],
    )
    assert scenario.raster.speed == 0.5
    assert scenario.raster.standoff == Scenario().raster.standoff
    assert scenario.random_seed == 3
    assert scenario.cycle.unattended is False
    assert scenario.wall_camera.mount_error_m == [0.001, 0.0, 0.0]
    assert scenario.arm.faults[0].joint == 3


def test_a_later_override_wins():
    scenario = load_scenario("cubes", ["raster.speed=0.5", "raster.speed=0.4"])
    assert scenario.raster.speed == 0.4


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("raster.spead=0.5", "spead"),
        ("no_such_part.speed=0.5", "no_such_part"),
        ("raster.speed", "key=value"),
        ("=1", "key=value"),
        ("random_seed.speed=1", "random_seed"),
        ("raster.speed=[", "raster.speed"),
        ("raster.speed=fast", "fast"),
        ("raster.speed=-1", "raster.speed"),
        ("raster.speed=.nan", "raster.speed"),
        ("raster.speed=2.4", "motion.nozzle_speed"),
        ("raster.coats=0", "raster.coats"),
        ("raster.coats=9", "raster.coats"),
        ("raster={coats: 2, cut_in: false}", "raster.coats"),
        ("raster={coats: 2, flash_off: 600.0}", "cycle.time_limit"),
        ("raster.flash_off=-1", "raster.flash_off"),
        ("tile.width=0", "tile.width"),
        ("arm.encoder_bits=99", "arm.encoder_bits"),
        ("arm.faults=[{joint: 6}]", "arm.faults"),
        ("wall_camera.mount_error_m=[1]", "mount_error_m"),
    ],
)
def test_a_bad_override_is_one_line_that_names_it(override, named):
    with pytest.raises(InputError) as error:
        load_scenario("cubes", [override])
    assert named in str(error.value)
    assert "\n" not in str(error.value)


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(InputError, match="blank, cubes"):
        load_scenario("cube")


@pytest.mark.parametrize(
    "text",
    [
        "cubes: {scene: cubes, colour: red}",
        "one: {}\ntwo: {}",
        "just words",
        "cubes: [1, 2]",
        "cubes: {scene: [",
        "",
    ],
)
def test_a_bad_file_is_one_line_that_names_it(text, tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match="bad") as error:
        load_scenario(str(path))
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        load_scenario(str(tmp_path / "nowhere.yaml"))


def numbers(value):
    """All numbers below a dataclass, with their dotted names."""
    for field in dataclasses.fields(value):
        item = getattr(value, field.name)
        if dataclasses.is_dataclass(item):
            yield from ((f"{field.name}.{k}", v) for k, v in numbers(item))
        elif isinstance(item, float):
            yield field.name, item


@pytest.mark.parametrize(
    "key", [k for k, v in numbers(Scenario()) if math.isfinite(v)], ids=str
)
def test_no_number_may_be_nan(key):
    with pytest.raises(InputError):
        load_scenario("blank", [f"{key}=.nan"])


@pytest.mark.parametrize("path", sorted(models_path("scenes").glob("*.yaml")), ids=str)
def test_a_scene_file_has_one_top_key_named_as_the_file(path):
    document = yaml.safe_load(path.read_text())
    assert list(document) == [path.name.removesuffix(".scene.yaml")]
