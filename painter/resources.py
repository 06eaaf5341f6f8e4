"""Where the data files that travel with the package are."""

from pathlib import Path

import painter_models


def models_path(*parts: str) -> Path:
    """Returns a path below the models folder (`package://painter_models/`)."""
    return Path(painter_models.__file__).parent.joinpath(*parts)
