import json

import pytest

from painter.cli.main import run


def test_drives_run_for_a_while_and_say_how_it_went(tmp_path, capsys, monkeypatch):
    # In this process: other tests must not run under SCHED_FIFO.
    monkeypatch.setattr("painter.jobs.run_drives.use_fifo", lambda priority: False)
    words = ["drives", "--interface", "local", "--channel", str(tmp_path / "can")]
    words += ["--duration", "0.2", "--fault", "emcy@elbow_pitch:0.1", "--json"]
    assert run(words) == 0
    out, err = capsys.readouterr()
    figures = json.loads(out)
    assert figures["time_s"] >= 0.2
    # Six boot-up messages and one emergency: nobody asked for more.
    assert figures["frames"] == 7
    assert figures["elbow_pitch_state"] == "FAULT"
    assert figures["base_yaw_state"] == "SWITCH ON DISABLED"
    assert "emcy at elbow_pitch" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--fault", "emcy"], "expected NAME"),
        (["--fault", "nothing:1"], "known are emcy"),
        (["--fault", "emcy@nose:1"], "axes are base_yaw"),
        (["--fault", "emcy:1.2.3"], "the time must be in s"),
        (["none.yaml"], "no such bus file"),
        (["--interface", "local", "--channel", "/nowhere/can"], "local /nowhere/can"),
    ],
)
def test_unusable_words_are_one_line(capsys, words, message):
    assert run(["drives", *words]) in (1, 2)
    err = capsys.readouterr().err
    assert message in err
    assert "Traceback" not in err
