"""Where the data files that travel with the package are."""

from pathlib import Path

import painter_models


def models_path(*parts: str) -> Path:
    """Returns a path below the models folder (`package://painter_models/`)."""
    return Path(painter_models.__file__).parent.joinpath(*parts)


def named_scenarios() -> list[str]:
    """Returns the names of the scenarios that come with the package."""
    files = models_path("scenarios").glob("*.scenario.yaml")
    return sorted(path.name.removesuffix(".scenario.yaml") for path in files)
