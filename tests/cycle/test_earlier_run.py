"""`painter simulate` refuses what it cannot go on with, before it writes anything."""

import pytest

from painter.cli.main import run
from painter.config import Scenario, dump_scenario
from painter.run.folder.folder import RunFolder


@pytest.fixture
def earlier(tmp_path):
    folder = RunFolder.create(tmp_path / "run", dump_scenario(Scenario(name="cubes")))
    folder.log(0.0, "started", versions={})
    return str(folder.path)


def test_options_that_do_not_fit_are_refused(earlier, tmp_path, capsys):
    for words, text in (
        (["--resume", earlier, "--touch-up", earlier], "only one of them"),
        (["--clear", "0,0,1,1"], "--clear: needs --touch-up"),
        (["cubes", "--resume", earlier], "has a scenario of its own"),
        (["--resume", str(tmp_path / "none")], "no such folder"),
        (["--resume", earlier], "was not stopped"),
        (["--resume", earlier, "--seed", "7"], "--set random_seed: got 7, but"),
        (["--touch-up", earlier], "segmentation.npz: no such file"),
    ):
        out = tmp_path / "out"
        assert run(["simulate", *words, "--out", str(out)]) == 2
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert text in line
        assert not out.exists()


def test_a_run_is_not_overwritten_by_what_goes_on_with_it(earlier, capsys):
    assert run(["simulate", "--resume", earlier, "--out", earlier]) == 2
    assert "is the folder of the earlier run" in capsys.readouterr().err
