"""Names that the field has other words for do not come back; docs/glossary.md."""

import csv
import io
import tokenize
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIST = Path(__file__).with_name("renamed_identifiers.csv")


def identifiers(source: str) -> set[str]:
    """All names in a module's code; words in strings and comments do not count."""
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    return {token.string for token in tokens if token.type == tokenize.NAME}


def renamed() -> list[dict[str, str]]:
    with LIST.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_no_renamed_identifier_is_used():
    names = {
        path.relative_to(ROOT).as_posix(): identifiers(path.read_text())
        for top in ("painter", "perception")
        for path in sorted((ROOT / top).rglob("*.py"))
    }
    bad = [
        f"{path}: {row['old']}, say {row['new']}"
        for row in renamed()
        for path, used in names.items()
        if path.startswith(f"{row['scope']}/") and row["old"] in used
    ]
    assert bad == []


def test_each_row_names_a_room_and_another_word():
    rows = renamed()
    assert len(rows) > 30
    assert [row for row in rows if not (ROOT / row["scope"]).is_dir()] == []
    assert [row for row in rows if row["old"] == row["new"]] == []


def test_identifiers_are_found_in_code_alone():
    source = 'class Linker:\n    """Linker of words."""\n    walk = prefer(1)  # gone\n'
    assert identifiers(source) >= {"Linker", "walk", "prefer"}
    assert "words" not in identifiers(source) and "gone" not in identifiers(source)
