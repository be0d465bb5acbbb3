"""The one touch of a pin whose place is known, live."""

from collections.abc import Callable
from dataclasses import replace

from robolink.calibration import CalibrationResult, carrying
from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.procedures import PinTouches, TouchPlan, approach_path, offset_z
from robolink.runner import Procedure


def measure_one_touch(
    plan: TouchPlan,
    *,
    here: Pose,
    pin_mm: tuple[float, float, float],
    u_deg: float,
    stored: ToolOffset | None,
    solve: Callable[[Pose], CalibrationResult],
) -> Procedure[CalibrationResult]:
    """Go above the pin, let the person touch it once, and lift off. Runs in Tool 0.

    Args:
        plan: Lift and clearance; the clearance has to be more than a new tip may be longer.
        here: Where the flange is.
        pin_mm: Where the pin is, base.
        u_deg: U at which it is touched.
        stored: The offset stored now; the tip is expected there.
        solve: Makes the result from the flange pose of the touch.

    Raises:
        CalibrationError: ``not_touched``, ``typed_ahead``, and as ``solve``.
        ConfigError: Nobody knows how long the tool is.

    Example:
        >>> from robolink.calibration import Pin
        >>> from robolink.methods import Absolute, measure_one_touch
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.procedures import TouchPlan
        >>> from robolink.testing import PaperCell
        >>> here, pin_mm, stored = Pose(300, 100, 20, 0), (310, 95, -40), ToolOffset(12, -4, -20)
        >>> solver = Absolute(Pin(*pin_mm), sigma_mm=0.02)
        >>> course = measure_one_touch(
        ...     TouchPlan(), here=here, pin_mm=pin_mm, u_deg=30, stored=stored,
        ...     solve=lambda touch: solver.solve([touch], stored),
        ... )
        >>> found = PaperCell(here, ToolOffset(12.2, -4.1, -20.3), pin_mm).run(course)
        >>> [round(length, 3) for length in found.offset.components()[:3]]
        [12.2, -4.1, -20.3]
    """
    guess = require_known_length(stored)
    contact = carrying(replace(here, u_deg=u_deg), guess, pin_mm)
    touches = PinTouches(plan, total=1)
    yield from approach_path(
        offset_z(contact, plan.lift_mm), here=here, purpose=tr("Moving above the pin.")
    )
    touch = yield from touches.again(
        contact,
        key=0,
        turning=tr("Moving beside the pin."),
        instruction=tr("Jog the tip onto the pin."),
    )
    return solve(touch)


def require_known_length(stored: ToolOffset | None) -> ToolOffset:
    """Return the offset by which a tip stops above the pin.

    Raises:
        ConfigError: There is none.
    """
    if stored is None:
        raise ConfigError(
            tr("The tool is not defined: how far above the pin it has to stop is not known."),
            remedy=tr(
                "Write about where the tip is with 'tool set', to a millimetre or two, and "
                "measure then."
            ),
        )
    return stored
