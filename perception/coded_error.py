"""The base of all errors; the standard library alone, so that it loads at once."""

import functools
from typing import Any


class CodedError(Exception):
    """Base of the project's errors; its message is one line for the user.

    Attributes:
        code: Stable name of what went wrong, "PNT-AREA-NNN", one for each place that
            raises: documentation and programs know the error by it.
        exit_code: Exit status of a command that ends with it.
    """

    exit_code = 1

    def __init__(self, message: str, *, code: str) -> None:
        """Creates it.

        Args:
            message: File or field, value, bound and cure, in one line.
            code: Its name; never given to another error later.
        """
        super().__init__(message)
        self.code = code

    def __reduce__(self) -> tuple[Any, ...]:
        """Lets the error cross to another process with its code."""
        return functools.partial(type(self), code=self.code), self.args
