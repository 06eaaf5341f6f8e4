"""Every scenario and scene that ships loads; overrides and bad input are handled."""

import dataclasses
import math

import pytest
import yaml

from painter.config import Scenario, dump_scenario, load_scenario
from painter.errors import InputError
from painter.resources import models_path, named_scenarios
from perception.settings import describe

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
        ("raster.speed=fast", "raster.speed must be a number, got 'fast'."),
        ("raster.coats=1.5", "raster.coats must be a whole number, got 1.5."),
        ("raster.cut_in=1", "raster.cut_in must be true or false, got 1."),
        ("raster.direction=vertical", "raster.direction is unknown; known are: speed"),
        ("raster=3", "raster must have fields, got 3."),
        ("raster.zones=3", "raster.zones must be a list, got 3."),
        ("raster.zones=[{kind: may, corners: []}]", "raster.zones[0].kind must be one"),
        ("motion.home_deg=[0, a]", "motion.home_deg[1] must be a number, got 'a'."),
        ("plant_config={time_step: a}", "plant_config cannot be read: could not"),
        ("plant_config={timestep: 0.001}", "plant_config cannot be read: The fields"),
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
        ("wall_camera.rate=91", "wall_camera.rate must be > 0 and <= 90 Hz, got 91"),
        ("wall_camera.stereo.fattening=4", "stereo.fattening must be odd and 1 to 51"),
        ("wall_camera.driver.fps=0", "wall_camera.driver.fps must be 1 to 90 Hz"),
        ("map={min_range: 3.0}", "map.min_range must be < max_range, 3.0 m, got 3.0"),
        ("motion.home_deg=[0, 0, 0, 0, 181]", "motion.home_deg[4] must be -180 to 180"),
        ("plant_config.time_step=0", "plant_config.time_step must be > 0"),
        ("gun.tip.transfer_efficiency=1.1", "gun.tip.transfer_efficiency must be > 0"),
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


LEAVES = [
    item for item in describe(Scenario) if not dataclasses.is_dataclass(item.kind)
]
# Models of devices and the paper's method: their numbers come from somewhere.
SOURCED = (
    *("wall_camera.stereo.", "wall_camera.driver.threshold_", "gun.tip.fan"),
    *("wall_camera.driver.spatial_", "wall_camera.driver.temporal_", "gun.tip.flow"),
    *("gun.tip.transfer_efficiency", "segmentation.neighbors", "segmentation.cell"),
    *("segmentation.std_multiplier", "segmentation.distance_threshold"),
    *("segmentation.stop_fraction", "segmentation.max_planes"),
    *("segmentation.cluster_tolerance", "segmentation.min_region_area"),
)


def is_number(item):
    return item.kind in (int, float) or item.kind == list[float]


@pytest.mark.parametrize("item", list(describe(Scenario)), ids=lambda item: item.path)
def test_every_setting_is_described_with_unit_and_bounds(item):
    assert item.text.endswith(".")
    # The unit stands in the metadata alone.
    assert not item.text.endswith((", m.", ", s.", ", px.", ", m/s.", ", deg."))
    if is_number(item):
        assert item.rule.unit
        assert max(item.rule.least, item.rule.above) > -math.inf
        assert min(item.rule.most, item.rule.below) < math.inf
    else:
        assert item.rule.unit in ("", "m")  # Zones have corners.
    if item.path.startswith(SOURCED):
        assert item.rule.source


def test_all_settings_are_described():
    """Every leaf of the dumped defaults is there, and nothing else."""

    def leaves(value, path=""):
        if not isinstance(value, dict):
            return {path}
        return {
            leaf
            for name, item in value.items()
            for leaf in leaves(item, f"{path}.{name}" if path else name)
        }

    ((_, fields),) = yaml.safe_load(dump_scenario(Scenario())).items()
    del fields["plant_config"]  # Drake's own.
    described = {item.path for item in LEAVES if "[]" not in item.path}
    assert described - {"plant_config"} == leaves(fields)


@pytest.mark.parametrize(
    "item",
    [item for item in LEAVES if item.kind in (int, float) and "[]" not in item.path],
    ids=lambda item: item.path,
)
def test_a_number_just_outside_its_bounds_is_refused_by_name(item):
    rule, step = item.rule, 1 if item.kind is int else 1e-6
    low = rule.above if math.isfinite(rule.above) else rule.least - step
    high = rule.below if math.isfinite(rule.below) else rule.most + step
    for value in (low, high):
        with pytest.raises(InputError, match=f"{item.path} must be .* got {value!r}"):
            load_scenario("blank", [f"{item.path}={value!r}"])


def test_a_bad_value_names_where_it_was_given(tmp_path):
    with pytest.raises(
        InputError, match=r"^--set raster\.speed=-1: raster\.speed must"
    ):
        load_scenario("blank", ["raster.coats=1", "raster.speed=-1"])
    file = tmp_path / "own.yaml"
    file.write_text("Own:\n  raster: {speed: -1}\n")
    with pytest.raises(InputError, match=r"own\.yaml: raster\.speed must"):
        load_scenario(str(file), ["raster.coats=1"])


def test_a_removed_setting_of_an_older_run_names_the_cure(tmp_path):
    file = tmp_path / "old.yaml"
    file.write_text("Old:\n  arm: {model_name: arm}\n")
    with pytest.raises(InputError, match=r"arm\.model_name .*delete the line"):
        load_scenario(str(file))
