"""`painter deploy`: options that exclude each other, operator, speeds."""

import pytest

from painter.cli.main import run
from painter.config import load_scenario
from painter.cycle.step_by_step import StepByStep
from painter.jobs.run_deployment import slowed
from painter.systems.values import Phase


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--speed", "0.3"], "needs --dry-run; the film would be 3.3 times as thick"),
        (["cubes", "--resume", "runs/none"], "has a scenario of its own"),
        (["--resume", "runs/none"], "no such folder"),
        (["nowhere"], "scenario 'nowhere' is unknown"),
        (["--bus", "none.yaml"], "no such bus file"),
    ],
)
def test_wrong_use_is_refused_before_anything_is_written(
    words, message, tmp_path, capsys
):
    out = tmp_path / "run"
    assert run(["deploy", *words, "--out", str(out)]) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not out.exists()


def test_reduced_speed_slows_everything():
    job = load_scenario("blank")
    slow = slowed(job, 0.3)
    assert slow.scan.speed == pytest.approx(0.3 * job.scan.speed)
    assert slow.raster.speed == pytest.approx(0.3 * job.raster.speed)
    assert slow.motion.limit_share == pytest.approx(0.3 * job.motion.limit_share)
    assert slowed(job, 1.0) is job


def test_step_by_step_pauses_asks_once_and_goes_on():
    asked = []

    def ask(question):
        asked.append(question)
        return "PAINT" not in question

    dut = StepByStep(every_phase=True, review=False, ask=ask)
    assert dut.command(Phase.SCAN) == "pause"
    assert dut.command(Phase.SCAN) is None  # It takes until the arm stands.
    assert dut.command(Phase.PAUSED) == "resume"
    assert dut.command(Phase.SCAN) is None
    assert dut.command(Phase.PAINT) == "pause"
    assert dut.command(Phase.PAUSED) == "abort"
    assert dut.command(Phase.ABORTED) is None
    assert asked == ["Continue with SCAN?", "Continue with PAINT?"]


def test_a_program_is_approved_once_where_somebody_attends():
    dut = StepByStep(every_phase=False, review=True, ask=lambda question: True)
    assert dut.command(Phase.PLAN) is None
    assert dut.command(Phase.REVIEW) == "approve"
    assert dut.command(Phase.REVIEW) is None
