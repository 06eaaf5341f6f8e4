"""Results on stdout, and output folders that are whole or not there."""

import json

import pytest

from painter.cli.common import output_folder, print_result, progress
from painter.errors import InputError


def test_json_is_alone_on_stdout(capsys):
    print_result({"area": 1.5, "labels": [1, 2]}, as_json=True)
    out, err = capsys.readouterr()
    assert json.loads(out) == {"area": 1.5, "labels": [1, 2]}
    assert err == ""


def test_text_has_a_line_for_each_name(capsys):
    print_result({"area_m2": 1.23456, "file": "a.npz"}, as_json=False)
    assert capsys.readouterr().out.splitlines() == ["area_m2  1.235", "file     a.npz"]


def test_progress_is_silent_where_there_is_no_terminal(capsys):
    with progress("Segmenting") as show:
        show(0.5, "planes")
    out, err = capsys.readouterr()
    assert out == ""
    assert err.strip() == ""


def test_folder_appears_with_its_files_at_the_end(tmp_path):
    folder = tmp_path / "deep" / "out"
    with output_folder(folder) as draft:
        (draft / "a.txt").write_text("a")
        assert not folder.exists()
    assert [path.name for path in folder.iterdir()] == ["a.txt"]
    assert [path.name for path in folder.parent.iterdir()] == ["out"]


def test_failure_leaves_nothing(tmp_path):
    with pytest.raises(RuntimeError), output_folder(tmp_path / "out") as draft:
        (draft / "a.txt").write_text("a")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_files_of_an_earlier_result_are_replaced_and_others_kept(tmp_path):
    (tmp_path / "a.txt").write_text("old")
    (tmp_path / "notes.txt").write_text("mine")
    with output_folder(tmp_path) as draft:
        (draft / "a.txt").write_text("new")
    assert (tmp_path / "a.txt").read_text() == "new"
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_file_in_the_way_is_an_input_error(tmp_path):
    (tmp_path / "out").write_text("a file")
    with (
        pytest.raises(InputError, match="is a file"),
        output_folder(tmp_path / "out"),
    ):
        pass
