"""Errors of perception; each message names the file or quantity, value and bound."""

from perception.coded_error import CodedError


class PerceptionError(CodedError):
    """Perception cannot give a right answer."""


class CloudReadError(PerceptionError):
    """A cloud or depth file is missing, truncated, empty or of an unknown form."""

    exit_code = 2


class GridSizeError(PerceptionError):
    """A tile has more cells than are worked on."""

    exit_code = 2


class NoWallError(PerceptionError):
    """There is no wall where one is expected, or not enough of one."""


class ObliqueWallError(NoWallError):
    """The wall is turned too far from where it is expected to be worked on."""


class AmbiguousWallError(NoWallError):
    """Two planes are equally good walls; the job must say which one is meant."""
