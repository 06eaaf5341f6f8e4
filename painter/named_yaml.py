"""Scenario and scene files: found by name or path, with one top key, the name."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from painter.errors import InputError
from painter.resources import models_path
from painter.typed_yaml import load_yaml


def read_named(
    kind: str, name: str, known: Sequence[str]
) -> tuple[Path, dict[str, Any]]:
    """Reads the fields of a scenario or a scene.

    Args:
        kind: "scenario" or "scene".
        name: A name of the package's files of that kind, or the path of a YAML file.
        known: All names, for the message.

    Returns:
        The file, and its fields with `name`, which is the top key by default.

    Raises:
        InputError: There is no such file, or it is no YAML with one top key.
    """
    path = Path(name)
    if path.suffix not in (".yaml", ".yml"):
        path = models_path(f"{kind}s", f"{name}.{kind}.yaml")
        if not path.is_file():
            raise InputError(
                f"{kind} {name!r} is unknown; known are: {', '.join(known)}.",
                code="PNT-FILE-001",
            )
    try:
        document = load_yaml(path.read_text())
    except FileNotFoundError:
        raise InputError(f"{path}: no such {kind} file.", code="PNT-FILE-002") from None
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        text = " ".join(str(error).split())
        raise InputError(f"{path}: {text}", code="PNT-FILE-003") from error
    if not isinstance(document, dict) or len(document) != 1:
        raise InputError(
            f"{path}: expected one top key, the {kind}'s name.", code="PNT-FILE-004"
        )
    ((top, fields),) = document.items()
    if not isinstance(fields, dict | None):
        raise InputError(
            f"{path}: expected fields below {top!r}, got {fields!r}.",
            code="PNT-FILE-005",
        )
    return path, {"name": str(top)} | (fields or {})
