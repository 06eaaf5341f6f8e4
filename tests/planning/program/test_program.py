"""Paint programs: strokes at their speed, place and time, nothing touched."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from painter.errors import CollisionError, InputError, MotionLimitError, ReachError
from painter.planning.clearance.obstacles import ObstacleBox
from painter.planning.config import MotionConfig, RasterConfig
from painter.planning.motion.verify import verify_motion, verify_strokes
from painter.planning.program.clear_strokes import has_run_out
from painter.planning.program.join_stroke import join_stroke
from painter.planning.program.program import strokes_from
from painter.planning.spray_path import Motion, Stroke

HOME = np.deg2rad(MotionConfig().home_deg)
WINDOW = (slice(80, 160), slice(60, 140), -0.1)
LOW_BOX = (slice(30, 45), slice(20, 40), 0.12)
TALL_BOX = (slice(30, 45), slice(20, 40), 0.40)


def plan(robot, wall, *, strokes=None, q0=HOME):
    planner = robot.planner()
    return planner.program(
        planner.strokes(wall) if strokes is None else strokes, wall, q0
    )


def gun_in_tile(robot, program, time):
    """Nozzle (n, 3) and spray axis (n, 3) in T along the executed spline."""
    q = program.motion.trajectory.vector_values(time).T
    R_WGs, p_WGs = robot.kinematics.gun_poses(q)
    X_TW = program.X_WT.inverse()
    return (X_TW @ p_WGs.T).T, (X_TW.rotation().matrix() @ R_WGs[:, :, 2].T).T


@pytest.fixture(scope="module")
def wall_with_openings():
    return WINDOW, LOW_BOX, (slice(100, 120), slice(160, 170), 0.05)


@pytest.fixture
def program(robot, make_wall, wall_with_openings):
    return plan(robot, make_wall(*wall_with_openings))


def test_strokes_run_at_constant_speed_square_and_in_place(robot, program):
    assert len(program.strokes) > 15
    # From so near to the wall the arm does not turn in the tile's lower corners.
    assert sum(item.stroke.length for item in program.skipped) <= 0.2 + 1e-9
    for item in program.skipped:
        assert item.stroke.kind == "cut_in"
        assert max(item.stroke.start_T[1], item.stroke.end_T[1]) <= 0.1 + 1e-9
    for stroke, (on, off) in zip(program.strokes, program.motion.spray_on, strict=True):
        start, end = on + 0.02, off + 0.02  # The valve's delay, both ways.
        assert end - start == pytest.approx(stroke.length / 0.6, rel=1e-9)
        time = np.linspace(start, end, 400)
        places, axes = gun_in_tile(robot, program, time)
        ideal = np.linspace(stroke.start_T, stroke.end_T, 400)
        # 0.1 % of the speed over a stroke of 2 m; the spline is good to some 10 µm.
        np.testing.assert_allclose(places[:, :2], ideal, atol=2e-4)
        np.testing.assert_allclose(places[:, 2], stroke.standoff, atol=2e-4)
        np.testing.assert_allclose(axes, [[0.0, 0.0, -1.0]] * 400, atol=1e-3)
        inside = slice(20, -20)
        speed = np.linalg.norm(np.gradient(places, time, axis=0), axis=1)[inside]
        np.testing.assert_allclose(speed, 0.6, rtol=1e-3)


def test_motion_starts_here_ends_at_home_and_keeps_every_limit(robot, program):
    motion = program.motion
    np.testing.assert_allclose(motion.q[[0, -1]], [HOME, HOME], atol=1e-9)
    assert not motion.v[[0, -1]].any()
    time = np.linspace(0.0, motion.duration, 40000)
    derivatives = (
        motion.trajectory.MakeDerivative(k).vector_values(time).T for k in (1, 2)
    )
    for values, bound in zip(
        derivatives, (robot.limits.v_max, robot.limits.a_max), strict=True
    ):
        assert (np.abs(values) <= 0.93 * bound).all()  # 0.9 of them, and the spline.
    assert robot.limits.contains(motion.q).all()


def test_motion_stays_clear_of_the_boxes_as_mapped(robot, make_wall, program):
    # Independently of the planner's boxes: the nozzle over the grid's heights.
    wall = make_wall(WINDOW, LOW_BOX)
    places, _ = gun_in_tile(robot, program, program.motion.time)
    row, column = (np.floor(places[:, i] / 0.01).astype(int) for i in (1, 0))
    over = (row >= 0) & (row < 200) & (column >= 0) & (column < 200)
    gap = places[over, 2] - np.asarray(wall.depth)[row[over], column[over]]
    assert gap.min() > 0.04


def test_blank_tile_takes_no_longer_than_its_strokes_and_turns(robot, make_wall):
    program = plan(robot, make_wall())
    spraying = sum(stroke.length for stroke in program.strokes) / 0.6
    turns = len(program.strokes) - 1
    # A turn reverses 0.6 m/s at 3 m/s² or so; approach and way home take the rest.
    assert program.motion.duration < spraying + 0.9 * turns + 6.0
    assert program.motion.duration < 72.0
    litres = 1.517e-5 * spraying * 1e3
    assert 1e3 * program.paint_volume == pytest.approx(litres)


def test_strokes_beside_a_tall_box_are_cut_back_and_reported(robot, make_wall):
    program = plan(robot, make_wall(TALL_BOX))
    assert program.skipped
    assert any("too near" in item.reason for item in program.skipped)
    for item in program.skipped:
        assert 0.0 <= min(item.stroke.start_T[0], item.stroke.end_T[0]) <= 0.55
    done = sum(stroke.length for stroke in program.strokes)
    left_out = sum(item.stroke.length for item in program.skipped)
    assert left_out < 0.1 * done
    # No nozzle over the box lower than its top and the clearance.
    places, _ = gun_in_tile(robot, program, program.motion.time)
    over = (abs(places[:, 0] - 0.3) < 0.1) & (abs(places[:, 1] - 0.375) < 0.075)
    assert places[over, 2].min(initial=np.inf) > 0.44


def test_wall_out_of_reach_names_the_distances(robot, make_wall):
    far = RigidTransform([0.7, 0.0, 0.0]) @ make_wall().X_WT
    with pytest.raises(ReachError, match=r"needs 1\.\d+ m .* the arm has 1\.57 m"):
        plan(robot, make_wall(X_WT=far))


def test_nothing_to_paint_is_a_program_without_strokes(robot, make_wall):
    program = plan(robot, make_wall((slice(0, 200), slice(0, 200), 0.0)))
    assert program.strokes == ()
    assert program.motion.spray_on.shape == (0, 2)


def test_verification_finds_a_stroke_that_is_out_of_time(robot, program):
    motion = program.motion
    late = program.replace(
        motion=Motion(motion.time, motion.q, motion.v, motion.spray_on + 0.1)
    )
    with pytest.raises(MotionLimitError, match="stroke 1: "):
        verify_strokes(late, kinematics=robot.kinematics, valve_delay=0.02)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda s: {"speed": 1.03 * s.speed}, "speed error is 0.01"),
        (lambda s: {"standoff": s.standoff + 0.003}, "stand-off error is 0.003"),
        (
            lambda s: {
                "start_T": s.start_T + [0.003, 0],
                "end_T": s.end_T + [0.003, 0],
            },
            "position across x is 0.003",
        ),
        (lambda s: {"end_T": s.part(0.0, 1.01).end_T}, "end is 0.0"),
    ],
)
def test_verification_names_the_stroke_that_is_not_as_it_should(
    robot, program, change, what
):
    number = next(k for k, s in enumerate(program.strokes, 1) if k > 2 and s.length > 1)
    strokes = list(program.strokes)
    wrong = strokes[number - 1]
    strokes[number - 1] = wrong.replace(**change(wrong))
    with pytest.raises(MotionLimitError, match=f"^stroke {number}: {what}"):
        verify_strokes(
            program.replace(strokes=tuple(strokes)),
            kinematics=robot.kinematics,
            valve_delay=0.02,
        )


def test_verification_finds_a_motion_that_is_too_fast(robot, program):
    motion = program.motion
    fast = Motion(motion.time / 2, motion.q, motion.v * 2, motion.spray_on / 2)
    with pytest.raises(MotionLimitError, match=r"rush: velocity of .* the limit is"):
        verify_motion(
            fast,
            kinematics=robot.kinematics,
            limits=robot.limits,
            limit_share=0.9,
            space=robot.transitions().space,
            what="rush",
        )


def test_a_coat_dries_at_home_before_the_next(robot, make_wall):
    raster = RasterConfig(coats=2, flash_off=45.0)
    planner = robot.planner(raster=raster)
    wall = make_wall(LOW_BOX)
    dut = planner.program(planner.strokes(wall), wall, HOME)
    coats = [stroke.coat for stroke in dut.strokes]
    assert coats == sorted(coats)
    assert set(coats) == {1, 2}
    last = coats.index(2)
    closes, opens = dut.motion.spray_on[last - 1, 1], dut.motion.spray_on[last, 0]
    assert opens - closes >= raster.flash_off
    still = np.abs(dut.motion.q - HOME).max(axis=1) < 1e-9
    between = still & (dut.motion.time > closes) & (dut.motion.time < opens)
    assert np.ptp(dut.motion.time[between]) == pytest.approx(45.0, abs=0.05)
    # What is left of it is in two coats, too.
    number = last - 1.5  # The last stroke but two of the first coat, half done.
    rest = planner.program(strokes_from(dut.strokes, number), wall, HOME)
    assert {stroke.coat for stroke in rest.strokes} == {1, 2}
    assert rest.motion.duration > raster.flash_off


def test_a_program_keeps_the_speed_that_its_nozzle_may_have(robot, make_wall):
    wall = make_wall(LOW_BOX)
    strokes = robot.planner().strokes(wall)
    free = plan(robot, wall, strokes=strokes)
    limits = robot.limits.replace(nozzle=robot.kinematics.nozzle, nozzle_speed=0.8)
    planner = robot.planner(limits=limits)
    dut = planner.program(strokes, wall, HOME)
    speeds = []
    for program in (free, dut):
        time = np.arange(0.0, program.motion.duration, 0.002)
        q = program.motion.trajectory.vector_values(time).T
        p_WGs = robot.kinematics.nozzle(q)
        speeds.append(np.linalg.norm(np.gradient(p_WGs, 0.002, axis=0), axis=1).max())
    assert speeds[0] > 0.9
    # 0.9 of it, and what the spline through the samples swings beyond.
    assert speeds[1] <= 0.9 * 0.8 * 1.01
    assert dut.motion.duration > free.motion.duration
    assert sum(s.length for s in dut.strokes) == pytest.approx(
        sum(s.length for s in free.strokes), rel=0.01
    )
    with pytest.raises(MotionLimitError, match=r"free: nozzle speed is .* m/s at .* s"):
        verify_motion(
            free.motion,
            kinematics=robot.kinematics,
            limits=limits,
            limit_share=0.9,
            space=robot.transitions().space,
            what="free",
        )


def covered(strokes):
    """Lengths of wall that are sprayed, by line and stand-off."""
    lengths = {}
    for stroke in strokes:
        (x, y), along = stroke.start_T, stroke.end_T - stroke.start_T
        foot = float(x - along[0] / along[1] * y)  # A stroke may lean a little.
        key = round(foot, 6), stroke.standoff
        lengths[key] = lengths.get(key, 0.0) + stroke.flow * stroke.length
    return lengths


def test_rest_of_a_program_sprays_what_is_not_done_yet(robot, make_wall):
    wall = make_wall((slice(60, 140), slice(0, 140), -0.1))
    whole = plan(robot, wall)
    # As a job is resumed that was stopped with a quarter of its third stroke done.
    rest = strokes_from(whole.strokes, 3.25)
    first = whole.strokes[2]
    begin = 0.75 * first.start_T + 0.25 * first.end_T
    np.testing.assert_allclose(rest[0].start_T, begin, atol=1e-9)
    np.testing.assert_allclose(rest[0].end_T, first.end_T, atol=1e-9)
    dut = plan(robot, wall, strokes=rest, q0=HOME + 0.1)
    assert dut.skipped == ()
    done = [*whole.strokes[:2], first.replace(end_T=begin)]
    assert covered([*done, *dut.strokes]) == pytest.approx(covered(whole.strokes))


def test_there_must_be_such_a_stroke(robot, make_wall):
    strokes = plan(robot, make_wall()).strokes
    with pytest.raises(InputError, match="from_stroke must be 1 to"):
        strokes_from(strokes, 99.0)


def test_strokes_that_differ_in_flow_alone_follow_without_a_gap(robot, make_wall):
    parts = [
        Stroke(np.array([1.0, a]), np.array([1.0, b]), 0.6, "body", 0, 0.3, flow)
        for a, b, flow in ((0.4, 1.0, 1.0), (1.0, 1.2, 0.5))
    ]
    dut = plan(robot, make_wall(), strokes=parts)
    opens = dut.motion.spray_on
    assert opens[0, 1] == pytest.approx(opens[1, 0], abs=1e-9)
    assert sorted(dut.motion.flow) == [0.5, 1.0]


def test_a_little_out_of_reach_is_left_out(robot, make_wall):
    tops = (1.9, 1.9, 1.9, 1.9, 2.5)
    strokes = [
        Stroke(np.array([x, 0.1]), np.array([x, top]), 0.6, "body", column, 0.3)
        for column, (x, top) in enumerate(
            zip(np.arange(5) * 0.2 + 0.6, tops, strict=True)
        )
    ]
    dut = plan(robot, make_wall(), strokes=strokes)
    assert len(dut.strokes) == 5
    (left_out,) = (s for s in dut.skipped if s.reason == "out of the arm's reach")
    assert max(left_out.stroke.start_T[1], left_out.stroke.end_T[1]) == 2.5


def test_a_stroke_that_ends_in_a_corner_with_no_way_on_is_trimmed(robot, make_wall):
    # A shelf over the stroke's end: there the gun can neither go on nor draw back much.
    shelf = (slice(150, 154), slice(60, 140), 0.45)
    stroke = Stroke(np.array([1.0, 0.5]), np.array([1.0, 1.36]), 0.6, "body", 0, 0.3)
    dut = plan(robot, make_wall(shelf), strokes=[stroke])
    (done,) = dut.strokes
    assert done.length <= stroke.length
    assert sum(s.stroke.length for s in dut.skipped) == pytest.approx(
        stroke.length - done.length
    )


class NoWay:
    """A planner that connects nothing but, after some calls, a stroke to rest."""

    def __init__(self, asked):
        self.asked = asked

    def to_rest(self, start):
        self.asked -= 1
        if self.asked:
            raise CollisionError("no way back", code="PNT-TEST-001")

    def from_rest(self, q, end):
        raise CollisionError("no way there", code="PNT-TEST-001")


@pytest.mark.parametrize("length", [0.03, 0.04, 0.05, 0.07, 0.10, 0.12])
def test_a_stroke_of_which_nothing_is_left_by_trimming_is_left_out(length):
    """Trims add up to such lengths; as shares, at 1.3 m, to 1 but for rounding."""
    start, end = np.array([0.3, 1.3]), np.array([0.3, 1.3 + length])
    stroke = Stroke(start, end, 0.6, "cut_in", 0, 0.2)
    for asked in range(1, 6):
        dut = join_stroke(stroke, None, HOME, NoWay(asked), has_run_out=False)
        assert dut.stroke is None and dut.transition == []
        assert [item.stroke for item in dut.skipped] == [stroke]


def test_run_out_is_room_beyond_the_end_in_the_direction_of_travel(robot):
    shelf = ObstacleBox("shelf", np.array([0.6, 1.5, 0.0]), np.array([1.4, 1.6, 0.34]))
    up = Stroke(np.array([1.0, 0.9]), np.array([1.0, 1.36]), 0.6, "body", 0, 0.3)
    down = up.replace(start_T=up.end_T, end_T=up.start_T)
    dut = has_run_out([up, down], robot.transitions(shelf))
    assert dut.tolist() == [False, True]
    assert has_run_out([up, down], robot.transitions()).tolist() == [True, True]
