"""`painter map` from the words on the command line to the files."""

import itertools
import json
import os
import signal
import sqlite3
import subprocess
import sys
import time

import numpy as np
import open3d as o3d
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from painter.cli.main import run
from perception.config import StereoConfig
from perception.depth_camera.depth import CameraIntrinsics
from perception.io.frames import read_poses, write_recording
from perception.synthetic.sequences import SequenceConfig, WallKind, render_sequence

STEREO = StereoConfig(width=424, height=240, fattening=5)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("blank")
    config = SequenceConfig(wall=WallKind.BLANK, rate=2.5, stereo=STEREO)
    frames = itertools.islice(render_sequence(config, 7), 14)
    write_recording(folder, CameraIntrinsics.from_stereo(STEREO), frames)
    return folder


def test_folder_holds_poses_map_and_report(recording, tmp_path, capsys):
    out, store = tmp_path / "out", tmp_path / "map.db"
    words = ["map", str(recording), "--out", str(out), "--store", str(store)]
    assert run([*words, "--json", "--mesh", "--set", "mapping.cell=0.01"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report == json.loads((out / "map.json").read_text())
    assert len(read_poses(out / "poses.txt")) == sum(report["frames"].values()) == 14
    cloud = o3d.t.io.read_point_cloud(out / "map.ply")
    assert cloud.point.positions.shape[0] == report["points"]
    np.testing.assert_allclose(cloud.point.positions.numpy()[:, 2], 0.0, atol=0.015)
    assert (out / "mesh.ply").is_file()
    assert report["observed_share"]["x"] == 0.0
    # The map file is mapped again with other parameters.
    words = ["map", str(store), "--out", str(tmp_path / "again"), "--json"]
    assert run([*words, "--set", "mapping.cell=0.02"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["keyframes"] == report["keyframes"]
    assert again["points"] < 0.5 * report["points"]


def test_a_blank_wall_without_poses_leaves_nothing(recording, tmp_path, capsys):
    out = tmp_path / "out"
    assert run(["map", str(recording), "--out", str(out), "--no-use-poses"]) == 1
    assert "too little texture" in capsys.readouterr().err
    assert not out.exists()


def test_a_session_is_joined_onto_a_map(tmp_path, capsys):
    config = SequenceConfig(wall=WallKind.TEXTURED, rate=2.5, stereo=STEREO)
    frames = list(itertools.islice(render_sequence(config, 7), 14))
    X_MN = RigidTransform(RollPitchYaw(0.0, 0.0, 0.4), [0.5, -0.2, 0.1])
    parts = {"first": frames[:9], "second": frames[6:]}
    parts["second"] = [
        (frame.replace(X_WC=X_MN.inverse() @ frame.X_WC), X_WC)
        for frame, X_WC in parts["second"]
    ]
    for name, part in parts.items():
        (tmp_path / name).mkdir()
        write_recording(tmp_path / name, CameraIntrinsics.from_stereo(STEREO), part)
    words = ["map", str(tmp_path / "first"), "--out", str(tmp_path / "one")]
    assert run([*words, "--store", str(tmp_path / "map.db")]) == 0
    capsys.readouterr()
    words = ["map", str(tmp_path / "second"), "--out", str(tmp_path / "both"), "--json"]
    assert run([*words, "--onto", str(tmp_path / "map.db")]) == 0
    report = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(report["joined"]["X_MN"], X_MN.GetAsMatrix4(), atol=0.02)
    # The second session's poses are in the first one's world now.
    for (_, X_WC), (frame, _) in zip(
        read_poses(tmp_path / "both" / "poses.txt"), parts["second"], strict=True
    ):
        off = X_WC.translation() - (X_MN @ frame.X_WC).translation()
        assert np.linalg.norm(off) < 0.01


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--set", "mapping.nothing=1"], "expected mapping.KEY=VALUE"),
        (["--set", "mapping.cell=wide"], "'wide' is not a number"),
        (["--set", "mapping.cell=-1"], "mapping.cell must be > 0"),
        (["--poses", "no_such_file.txt"], "no such file"),
        (["--voxels", "0"], "--voxels must be > 0 m, got 0.0"),
        (["--onto", "no_such_map.db"], "no_such_map.db: no such file"),
    ],
)
def test_wrong_words_are_one_line(recording, tmp_path, capsys, words, message):
    assert run(["map", str(recording), "--out", str(tmp_path / "out"), *words]) == 2
    assert message in capsys.readouterr().err


def test_a_killed_session_loses_no_keyframe(recording, tmp_path):
    store = tmp_path / "map.db"
    words = [
        "map",
        str(recording),
        "--out",
        str(tmp_path / "out"),
        "--store",
        str(store),
    ]
    code = f"from painter.cli.main import run; run({words!r})"
    process = subprocess.Popen([sys.executable, "-c", code])
    kept = 0
    deadline = time.monotonic() + 60.0
    while kept < 3 and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
        if store.is_file():
            with sqlite3.connect(store) as db:
                try:
                    (kept,) = db.execute("SELECT COUNT(*) FROM keyframes").fetchone()
                except sqlite3.OperationalError:
                    continue
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert kept >= 3
    assert run(words) == 0
    with sqlite3.connect(store) as db:
        numbers = [k for (k,) in db.execute("SELECT k FROM keyframes ORDER BY k")]
    assert numbers == list(range(len(numbers)))
    assert len(numbers) >= kept
    assert len(read_poses(tmp_path / "out" / "poses.txt")) == 14
