"""Airless tips by their number, as makers print it on the tip.

The first digit times 5 cm is the fan's width at 0.30 m, the other two are the orifice
in thousandths of an inch. Source: Graco, "Airless tips: tips on tips" (tip guide 0).
"""

from painter.planning.config import TipConfig

ORIFICES = (9, 11, 13, 15, 17, 19, 21, 23, 25)  # Thousandths of an inch, as sold.
_FAN_WIDTH = 0.05  # m a unit of the first digit.
# Water at 138 bar through the 0.015 inch orifice, m³/s; flow goes with its area.
# Source: orifice equation, Q = Cd A sqrt(2 Δp / rho), Cd = 0.8.
_ORIFICE = 15
_FLOW = 1.517e-5
_FAN_THICKNESS = 0.2  # Of the width: an assumption, see models/gun/README.md.


def airless_tip(number: int) -> TipConfig:
    """Returns the tip with a three-digit number, such as 515.

    Its flow is water's; thicker paint flows less, and a worn tip gives more.

    Args:
        number: 2 to 8 hundred and an orifice of `ORIFICES`.

    Raises:
        ValueError: There is no such tip.
    """
    digit, orifice = divmod(number, 100)
    if not 2 <= digit <= 8 or orifice not in ORIFICES:
        known = ", ".join(f"{size:02d}" for size in ORIFICES)
        raise ValueError(
            f"tip must be 2 to 8 hundred and one of {known}, got {number!r}."
        )
    width = digit * _FAN_WIDTH
    return TipConfig(
        fan_width=width,
        fan_thickness=_FAN_THICKNESS * width,
        flow=_FLOW * (orifice / _ORIFICE) ** 2,
    )
