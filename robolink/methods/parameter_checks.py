"""The fields of a method's parameters, and whether its results can be judged.

Commands, recipes and docs read the same fields; what is wrong is told in the same words to all.
"""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from inspect import get_annotations
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args, get_origin, get_type_hints

from annotated_types import Ge, Gt, Le, Len, MaxLen, MinLen

from robolink.errors import ConfigError
from robolink.files.key_problems import at_least, at_most, holds_at_least, holds_at_most, more_than
from robolink.files.toml import Problem
from robolink.messages import tr
from robolink.methods.method import (
    NOTHING_STATED,
    AnyMethod,
    Check,
    Help,
    MethodParameters,
    Option,
    StatedLimits,
    Unit,
)

if TYPE_CHECKING:
    from robolink.methods.method import Site
    from robolink.model import WorkBox
    from robolink.procedures import TipSource


_UNITS = ("_mm_s", "_mm_per_px", "_mm", "_deg")


@dataclass(frozen=True, slots=True)
class ParameterField:
    """One parameter.

    Attributes:
        name: Its name; the key in a recipe.
        kind: Its type without limits: ``float``, ``tuple[Pair, ...]`` ..; never ``None``.
        metadata: Its limits.
        default: What counts when nobody says it.
        required: Whether somebody has to say it.
        help: What it means.
        unit: Its unit, empty for none.
        option: How a command offers it.
    """

    name: str
    kind: Any
    metadata: tuple[object, ...]
    default: object
    required: bool
    help: str
    unit: str
    option: Option

    @property
    def flag(self) -> str:
        """The name of its option."""
        if self.option.flag:
            return self.option.flag.partition("/")[0]
        stem = next((self.name.removesuffix(u) for u in _UNITS if self.name.endswith(u)), self.name)
        return "--" + stem.replace("_", "-")

    @property
    def in_recipe(self) -> bool:
        """Whether it is a key of ``[source]``."""
        return not self.option.from_recipe


# No functools.cache: mypy does not accept the type of a dataclass with its own hash as Hashable.
_read: dict[type[Any], tuple[ParameterField, ...]] = {}


def fields_of(parameters: type[Any]) -> tuple[ParameterField, ...]:
    """Return the parameters of a method: its own before the shared ones.

    Args:
        parameters: A :class:`MethodParameters`, or a dataclass that is part of one.
    """
    if parameters not in _read:
        hints = get_type_hints(parameters, include_extras=True)
        order = [name for owner in parameters.__mro__ for name in get_annotations(owner)]
        found = sorted(dataclasses.fields(parameters), key=lambda one: order.index(one.name))
        _read[parameters] = tuple(_field(one, hints[one.name]) for one in found)
    return _read[parameters]


def _field(one: dataclasses.Field[Any], hint: object) -> ParameterField:
    kind, metadata = bare(hint)

    def said(wanted: type[Any]) -> Any:  # noqa: ANN401 - the annotation's own
        return next((item for item in metadata if isinstance(item, wanted)), None)

    explained, unit = said(Help), said(Unit)
    assert explained is not None, one.name  # noqa: S101 - every parameter must have help
    return ParameterField(
        one.name,
        kind,
        tuple(item for item in metadata if not isinstance(item, (Help, Unit, Option))),
        None if one.default is dataclasses.MISSING else one.default,
        one.default is dataclasses.MISSING,
        explained.sentence,
        unit.name if unit else "",
        said(Option) or Option(),
    )


def bare(hint: object) -> tuple[Any, tuple[object, ...]]:
    """Return a type without ``None`` and without metadata, and the metadata, outermost first."""
    metadata: tuple[object, ...] = ()
    while True:
        origin = get_origin(hint)
        if origin is Annotated:
            hint, *more = get_args(hint)
            metadata = (*more, *metadata)
        elif origin in (UnionType, Union):
            (hint,) = (part for part in get_args(hint) if part is not NoneType)
        else:
            return hint, metadata


def refusals(value: object, kind: object, metadata: tuple[object, ...]) -> Iterator[str]:
    """Yield why a value of the right type breaks its limits, in the words of every refusal."""
    if isinstance(value, tuple):
        yield from _of_length(len(value), metadata)
        arguments = get_args(kind)
        repeated = len(arguments) == 2 and arguments[1] is Ellipsis
        for place, item in enumerate(value):
            inner, limits = bare(arguments[0 if repeated else place])
            yield from refusals(item, inner, limits)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        yield from _of_size(value, metadata)


def _of_size(value: float, metadata: tuple[object, ...]) -> Iterator[str]:
    for limit in metadata:
        match limit:
            case Ge(ge) if not value >= ge:  # type: ignore[operator]
                yield at_least(ge)
            case Gt(gt) if not value > gt:  # type: ignore[operator]
                yield more_than(gt)
            case Le(le) if not value <= le:  # type: ignore[operator]
                yield at_most(le)


def _of_length(count: int, metadata: tuple[object, ...]) -> Iterator[str]:
    for limit in metadata:
        match limit:
            case MinLen(least) | Len(min_length=least) if count < least:
                yield holds_at_least(least)
            case MaxLen(most) | Len(max_length=most) if most is not None and count > most:
                yield holds_at_most(most)


def source_of(
    method: AnyMethod,
    parameters: MethodParameters,
    site: "Site",
    *,
    limits: StatedLimits = NOTHING_STATED,
    box: "WorkBox | None" = None,
) -> "TipSource":
    """Return the source of a method; first refuse what a recipe would be refused.

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
        >>> from robolink.controllers import SimpleController
        >>> method = find_method("two-pose")
        >>> pin = Station(id="PIN-07", kind=StationKind.PIN)
        >>> site = Site(controller=SimpleController(), tool=1, station=pin)
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
            remedy=tr("Nothing was sent. docs/methods.md lists the parameters."),
        )
    source: TipSource = method.source(parameters, site)
    return source


def parameter_problems(
    method: AnyMethod, parameters: MethodParameters, check: Check
) -> Iterator[Problem]:
    """Yield all that is wrong with parameters, and with judging their results.

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
    """Check that residuals are judged only if there are any."""
    why = parameters.no_residual()
    for name in ("rms_mm", "max_mm"):
        if why and getattr(limits, name) is not None:
            yield Problem(name, why)


def _of_interval(
    method: AnyMethod, parameters: MethodParameters, limits: StatedLimits, check: Check
) -> Iterator[Problem]:
    """Check that the interval can be known, and can be as narrow as required."""
    from robolink.calibration import NORMAL_95  # not needed for --help

    if limits.interval_mm is None:
        return
    if limits.sigma_mm is None:
        # For one touch, it may come from the calibration before.
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
