"""Every error of the project has a code of its own, by which the docs know it."""

import ast
import pickle
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import painter.canopen.protocol.sdo
import painter.errors
import perception.errors
from perception.coded_error import CodedError

ROOT = Path(__file__).parents[1]
CODE = re.compile(r"PNT-[A-Z]+-\d{3}")


def codes() -> Iterator[tuple[str, str]]:
    """Yields the place and the value of each literal code in the source."""
    for top in ("painter", "perception"):
        for path in sorted((ROOT / top).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.keyword) and node.arg == "code":
                    for value in ast.walk(node.value):
                        if isinstance(value, ast.Constant):
                            place = f"{path.relative_to(ROOT)}:{value.lineno}"
                            if isinstance(value.value, str):
                                yield place, value.value


def test_codes_have_one_form_and_one_place_each():
    found = list(codes())
    assert len(found) > 200
    assert [entry for entry in found if not CODE.fullmatch(entry[1])] == []
    count = Counter(code for _, code in found)
    assert [entry for entry in found if count[entry[1]] > 1] == []


def test_errors_without_a_code_cannot_be_made():
    modules = (painter.errors, perception.errors)
    kinds = [
        kind
        for module in modules
        for kind in vars(module).values()
        if isinstance(kind, type) and issubclass(kind, CodedError)
    ]
    assert len(kinds) > 10
    for kind in kinds:
        try:
            kind("what, where, bound")
        except TypeError:
            continue
        raise AssertionError(f"{kind.__name__} needs no code")


def test_errors_cross_to_another_process_with_their_code():
    error = painter.errors.InputError("a.yaml: no.", code="PNT-TEST-001")
    copy = pickle.loads(pickle.dumps(error))
    assert (type(copy), str(copy), copy.code) == (
        type(error),
        "a.yaml: no.",
        error.code,
    )
    sdo = painter.canopen.protocol.sdo.SdoError(
        "read failed.", code="PNT-TEST-002", abort_code=0x05040000
    )
    copy = pickle.loads(pickle.dumps(sdo))
    assert (copy.code, copy.abort_code) == ("PNT-TEST-002", 0x05040000)
