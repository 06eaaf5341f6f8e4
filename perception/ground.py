"""What every room uses: frozen values, array types, checks.

NumPy alone.
"""

import dataclasses
import math
from typing import Any, Self

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]


class FrozenValue:
    """Base of frozen dataclasses that travel on ports or live in a Context.

    Drake deep-copies the Python state of a system around its unrestricted updates and
    passes references along ports, so a value never changes: its arrays are made
    read-only and a copy is the value itself.
    """

    def __post_init__(self) -> None:
        """Makes every array field read-only."""
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def __deepcopy__(self, memo: dict[int, object]) -> Self:
        """Returns the value itself: it cannot change."""
        return self

    def replace(self, **changes: Any) -> Self:
        """Returns a copy with some fields exchanged."""
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]


def check_positive(owner: str, **values: float) -> None:
    """Raises if a value is not a finite number above zero.

    Args:
        owner: What the fields belong to, for the message.
        values: Field names and values.

    Raises:
        ValueError: A value is not finite or not > 0; names the field and the value.
    """
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{owner}.{name} must be > 0, got {value!r}.")
