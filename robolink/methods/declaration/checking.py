"""Whether one can measure with parameters and judge the result; the same for all who ask."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from robolink.errors import ConfigError
from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.methods.declaration.fields import fields_of, refusals
from robolink.methods.declaration.method import (
    NOTHING_STATED,
    AnyMethod,
    Check,
    MethodParameters,
    StatedLimits,
)

if TYPE_CHECKING:
    from robolink.methods.declaration.site import Site
    from robolink.model import WorkBox
    from robolink.procedures import TipSource


def source_of(
    method: AnyMethod,
    parameters: MethodParameters,
    site: "Site",
    *,
    limits: StatedLimits = NOTHING_STATED,
    box: "WorkBox | None" = None,
) -> "TipSource":
    """Return what measures by a method; refuse beforehand what a recipe would be refused.

    Args:
        method: The method.
        parameters: Its parameters.
        site: Where it measures.
        limits: By what the measurement will be judged, mm.
        box: In which the flange may go, where that is known.

    Raises:
        ConfigError: A parameter is outside its limits, does not go together with others, or what
            is to be judged by a limit leaves nothing to judge. Nothing has been sent.
        RobolinkError: What the method itself finds missing at the site.

    Example:
        >>> from robolink.methods import Site, find_method, source_of
        >>> from robolink.stations import Station, StationKind
        >>> from robolink.testing import MemoryController
        >>> method = find_method("two-pose")
        >>> pin = Station(id="PIN-07", kind=StationKind.PIN)
        >>> site = Site(controller=MemoryController(), tool=1, station=pin)
        >>> type(source_of(method, method.parameters(), site)).__name__
        'TwoPoseSource'
    """
    check = Check(
        limits=limits,
        box_height_mm=None if box is None else box.height_mm,
        points=len(site.points) if site.points else None,
    )
    found = tuple(parameter_problems(method, parameters, check))
    if found:
        raise ConfigError(
            "\n".join(f"{problem}." for problem in found),
            remedy=tr("Nothing was sent. docs/methods.md says what can be given."),
        )
    source: TipSource = method.source(parameters, site)
    return source


def parameter_problems(
    method: AnyMethod, parameters: MethodParameters, check: Check
) -> Iterator[Problem]:
    """Yield all that is wrong with parameters, and with judging what they lead to.

    The place of a problem is the name of a parameter, or of one of :class:`StatedLimits`. What
    goes together is asked only of parameters that are right in themselves.

    Args:
        method: The method.
        parameters: Its parameters.
        check: What is known besides them: what was stated, and how high the box is.

    Example:
        >>> from robolink.methods import Check, find_method, parameter_problems
        >>> method = find_method("n-angle")
        >>> parameters = method.parameters(count=2)
        >>> [problem.where for problem in parameter_problems(method, parameters, Check())]
        ['count']
    """
    outside = tuple(_outside(parameters))
    if outside:
        yield from outside
        return
    yield from parameters.problems(check)
    yield from _of_room(parameters, check)
    if check.limits is not None:
        yield from order_of_residuals(check.limits)
        yield from _of_residuals(parameters, check.limits)
        yield from _of_interval(method, parameters, check.limits, check)


def _outside(parameters: MethodParameters) -> Iterator[Problem]:
    for field in fields_of(type(parameters)):
        value = getattr(parameters, field.name)
        if value is not None:
            for why in refusals(value, field.kind, field.metadata):
                yield Problem(field.name, why)


def _of_room(parameters: MethodParameters, check: Check) -> Iterator[Problem]:
    """Check that the box is high enough for the lift."""
    room_mm, height_mm = parameters.room_mm(), check.box_height_mm
    if height_mm is not None and not check.poses_exist and room_mm > height_mm:
        yield Problem(
            "lift_mm",
            tr(
                "must leave room: {room:g} mm of height are needed, and the box is {height:g} mm "
                "high",
                room=room_mm,
                height=height_mm,
            ),
        )


def order_of_residuals(limits: StatedLimits) -> Iterator[Problem]:
    """Check that the limit of one residual is not below that of their rms."""
    if limits.rms_mm is not None and limits.max_mm is not None and limits.max_mm < limits.rms_mm:
        yield Problem(
            "max_mm",
            tr("must be at least the limit of the rms: no rms exceeds the largest residual"),
        )


def _of_residuals(parameters: MethodParameters, limits: StatedLimits) -> Iterator[Problem]:
    """Check that residuals are judged only where there are some."""
    why = parameters.no_residual()
    for name in ("rms_mm", "max_mm"):
        if why and getattr(limits, name) is not None:
            yield Problem(name, why)


def _of_interval(
    method: AnyMethod, parameters: MethodParameters, limits: StatedLimits, check: Check
) -> Iterator[Problem]:
    """Check that the interval can be known, and can be as narrow as it has to be."""
    from robolink.calibration import NORMAL_95  # what --help does without

    if limits.interval_mm is None:
        return
    if limits.sigma_mm is None:
        # One touch may take it from the calibration before.
        if parameters.no_residual() and method.by_reference:
            yield Problem(
                "sigma_mm",
                tr(
                    "is missing: the measurement cannot check itself, so the interval "
                    "can be judged only from a stated standard deviation"
                ),
            )
    elif not check.poses_exist and (gain := parameters.sigma_gain()):
        half_mm = NORMAL_95 * limits.sigma_mm * gain
        if half_mm > limits.interval_mm:
            yield Problem(
                "interval_mm",
                tr(
                    "can never be met: with a standard deviation of {sigma:g} mm and these angles "
                    "it is {half:.3f} mm",
                    sigma=limits.sigma_mm,
                    half=half_mm,
                ),
            )
