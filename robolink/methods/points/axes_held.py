"""Whether poses were taught with all axes held by their motors.

A robot whose axes are let go (SFREE) is pushed by hand; where it then stands, its joints yield and
the weight of the arm takes up their play. EPSON's instructions for this measurement forbid it, and
no pose shows it afterwards (docs/reference/epson.md 3.2). So a person is asked, once a command.
"""

from robolink.errors import CalibrationError
from robolink.messages import tr
from robolink.model import AnsweredBy
from robolink.procedures import MeasurementContext


def were_held(context: MeasurementContext, *, stated: bool) -> bool:
    """Return whether somebody says that all axes were held; the answer goes on record.

    Args:
        context: What asks.
        stated: Whether it was said beforehand, by an option or in the recipe.

    Returns:
        ``False`` where nobody said it and nobody is to be asked.

    Raises:
        CalibrationError: ``axes_free``: they were let go.

    Example:
        >>> from robolink.methods.points.axes_held import were_held
        >>> from robolink.calibration_run import Limits
        >>> from robolink.procedures import MeasurementContext
        >>> from robolink.testing import MemoryController
        >>> with MemoryController() as controller:
        ...     settings = Limits().settings
        ...     context = MeasurementContext(controller, None, start=None, settings=settings)
        ...     were_held(context, stated=True)
        True
    """
    by_recipe = bool(context.controller.outcomes.signature.recipe)
    by = AnsweredBy.RECIPE if by_recipe else AnsweredBy.OPTION
    said = context.ask_once(held_question(), given=by if stated else None)
    if said is False:
        raise CalibrationError(
            "axes_free",
            tr("These poses were taught with axes let go, so they are not where the tip touched."),
            remedy=tr(
                "Nothing was written. Switch the motors on (no SFREE), bring the tip onto the pin "
                "by jogging, and teach them again."
            ),
        )
    return said is True


def held_question() -> str:
    """Return the question."""
    return tr("Were all axes held by their motors (not SFREE) when these poses were taught?")
