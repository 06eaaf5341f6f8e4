"""Errors that Painter reports in one line: what, where, and the bound."""

from perception.coded_error import CodedError


class PainterError(CodedError):
    """A job failed; the command line prints message and code, and exits."""


class InputError(PainterError):
    """An input (file, field, argument) cannot be used; nothing was started."""

    exit_code = 2


class PortTypeError(PainterError):
    """A system lacks a port, or a port carries another type than expected."""


class ReachError(PainterError):
    """The arm cannot reach a pose that the job needs."""


class CollisionError(PainterError):
    """A planned motion comes closer to something than the clearance allows."""


class MotionLimitError(PainterError):
    """A planned motion exceeds a joint limit or does not hold its gun speed."""


class FaultError(PainterError):
    """The cycle ended in FAULT; the message is the latched cause."""


class BusError(PainterError):
    """The robot's bus, or a device on it, does not do what it should."""
