"""The command of a calibration method, made from the method's declaration."""

from collections.abc import Callable, Mapping
from typing import Any, Final, Literal

import click
from click.core import ParameterSource

from robolink.errors import ConfigError
from robolink.messages import declared, tr
from robolink.methods import (
    AnyMethod,
    Check,
    MethodParameters,
    ParameterField,
    StatedLimits,
    fields_of,
    parameter_problems,
)
from robolink.stations import StationKind
from robolink_cli.access.cell import with_cell_limits
from robolink_cli.commands.measure.calibrate.request import LENGTH, CalibrationRequest, request_from
from robolink_cli.commands.measure.calibrate.values import as_typed, is_repeated, type_of
from robolink_cli.options.consent import MotionOption, motion_option
from robolink_cli.options.declaration import declared_options
from robolink_cli.options.pose_source import PoseSource, pose_source_options, taught_points_option
from robolink_cli.session.completion import complete_station
from robolink_cli.session.context import CliContext, controller_options

_CELL_KEYS: Final = {
    "lift_mm": "lift_mm",
    "clearance_mm": "clearance_mm",
    "speed_mm_s": "speed_mm_s",
    "box_mm": "box_mm",
    "max_change_mm": "max_change_mm",
    "tolerance_mm": "drift_tolerance_mm",
    "rms_mm": "rms_tolerance_mm",
    "residual_mm": "residual_tolerance_mm",
    "interval_mm": "interval_tolerance_mm",
}
"""Keys of the cell file by option."""


def calibration_options(function: Callable[..., None]) -> Callable[..., int | None]:
    """Add the common options; the method gets a ``CalibrationRequest`` and its own.

    Limits that nobody typed are taken from the cell, for the method's own options too.
    """

    def framed(context: CliContext, **given: Any) -> None:  # noqa: ANN401 - click passes the options by name
        options = with_cell_limits(
            context.cell, given, {o: k for o, k in _CELL_KEYS.items() if o in given}
        )
        framing = request_from.__annotations__.keys() & options
        frame = request_from(context, **{name: options.pop(name) for name in framing})
        function(frame, **options)

    add: Callable[..., Callable[..., int | None]] = declared_options(request_from)
    return add(controller_options(framed))


def sigma_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--sigma``."""
    command: Callable[..., Any] = click.option(
        "--sigma",
        "sigma_mm",
        type=LENGTH,
        metavar="MM",
        help=declared("Standard deviation of one coordinate of one measurement, if known."),
    )(function)
    return command


_METAVARS: Final = {"mm": "MM", "degrees": "DEG", "mm/s": "MM_S"}

_STATIONS: Final = {
    StationKind.PIN: declared("Name of the pin."),
    StationKind.BEAMS: declared("Name of the beams."),
    StationKind.TOUCH: declared("Name of the surface."),
    StationKind.CAMERA: declared("Name of the camera's station."),
}

_LIMITS: Final = {
    "sigma_mm": "--sigma",
    "rms_mm": "--max-rms",
    "max_mm": "--max-residual",
    "interval_mm": "--max-interval",
}
"""Options by the limit that they set."""

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def command_of(method: AnyMethod) -> click.Command:
    """Return the command ``calibrate NAME`` of a method."""
    parameters = fields_of(method.parameters)

    def run(
        frame: CalibrationRequest,
        *,
        station: str | None,
        sigma_mm: float | None,
        at: str | None = None,
        poses: PoseSource | None = None,
        **given: Any,  # noqa: ANN401 - click passes the options by name
    ) -> None:
        from robolink_cli.commands.measure.calibrate.method_run import calibrate_with

        check = _check(method, frame, sigma_mm=sigma_mm, poses=poses)
        chosen = _parameters(method, given, check)
        calibrate_with(
            method, chosen, frame, station=station, at=at, sigma_mm=sigma_mm, poses=poses
        )

    command: Callable[..., Any] = calibration_options(run)
    for add in reversed([*map(_option, parameters), *_of_the_place(method)]):
        command = add(command)
    made = click.command(method.name, help=method.description, short_help=method.summary)(command)
    if not method.needs.motion:
        for option in made.params:
            if isinstance(option, MotionOption):
                option.hidden = True
    return made


def _of_the_place(method: AnyMethod) -> list[Decorator]:
    """Return the options for the place of the measurement, and its poses."""
    options: list[Decorator] = [sigma_option, _station_option(method)]
    if method.needs.place is not None:
        options.append(
            motion_option(
                "--at",
                metavar="X,Y,Z",
                help=declared("Where the station is, in the base; default: its recorded place."),
            )
        )
    if method.from_poses is not None and method.pose_help is not None:
        said = method.pose_help
        if method.needs.motion:
            added = pose_source_options(points=said.points, typed=said.typed, path=said.path)
        else:
            added = taught_points_option(said.points)
        options.append(added)
    return options


def _station_option(method: AnyMethod) -> Decorator:
    needs = method.needs
    known = _STATIONS[needs.station]
    found = tr("Name of the pin; its place is recorded, so that later one touch is enough.")
    return click.option(
        "--station",
        metavar="ID",
        required=needs.named,
        shell_complete=complete_station,
        help=found if needs.finds_pin else known,
    )


def _option(field: ParameterField) -> Decorator:
    """Return a decorator that adds the option of a parameter."""
    kind = motion_option if field.option.moves else click.option
    default = field.option.default_or(field.default)
    if field.option.is_choice or field.kind is bool:
        said = False if field.option.is_choice else default
        flags = field.option.flag or field.flag
        return kind(
            flags, field.name, is_flag=True, default=said, show_default=bool(said), help=field.help
        )
    attributes: dict[str, Any] = {"type": type_of(field), "help": field.help}
    metavar = field.option.metavar or _METAVARS.get(field.unit, "N" if _counts(field) else "")
    if metavar and not _is_choice(field):
        attributes["metavar"] = metavar
    if is_repeated(field):
        attributes["multiple"] = True
    elif default is not None:
        attributes |= {"default": as_typed(default), "show_default": True}
    return kind(field.flag, field.name, **attributes)


def _counts(field: ParameterField) -> bool:
    return field.kind in (int, int | None)


def _is_choice(field: ParameterField) -> bool:
    return getattr(field.kind, "__origin__", None) is Literal


def _check(
    method: AnyMethod,
    frame: CalibrationRequest,
    *,
    sigma_mm: float | None,
    poses: PoseSource | None,
) -> Check:
    """Return what is known besides the parameters: typed limits, not those of the cell."""
    given, criteria = _typed(), frame.criteria
    stated = StatedLimits(
        sigma_mm=sigma_mm,
        rms_mm=criteria.rms_mm if "rms_mm" in given else None,
        max_mm=criteria.max_residual_mm if "residual_mm" in given else None,
        interval_mm=criteria.interval_mm if "interval_mm" in given else None,
    )
    return Check(
        given=given,
        limits=stated,
        box_height_mm=frame.limits.box.height_mm,
        poses_exist=poses is not None,
        points=len(poses.points) if poses is not None and poses.kind == "points" else None,
        spell=_spelled(method).__getitem__,
    )


def _spelled(method: AnyMethod) -> dict[str, str]:
    """Return the option of each parameter and of each limit."""
    return {
        "points": "--points",
        **_LIMITS,
        **{field.name: field.flag for field in fields_of(method.parameters)},
    }


def _parameters(method: AnyMethod, given: Mapping[str, Any], check: Check) -> MethodParameters:
    """Return the parameters of a method.

    Raises:
        ConfigError: Some are outside their limits, or do not go together.
    """
    fields = fields_of(method.parameters)
    values = {field.name: _value(field, given[field.name]) for field in fields}
    parameters: MethodParameters = method.parameters(**values)
    problems = tuple(parameter_problems(method, parameters, check))
    if problems:
        spelled = _spelled(method)
        lines = [f"{spelled[one.where.partition('#')[0]]}: {one.what}" for one in problems]
        raise ConfigError(
            "\n".join(f"{line}." for line in lines),
            remedy=tr(
                "Nothing was sent. Help: robolink calibrate {name} --help",
                name=method.name,
            ),
        )
    return parameters


def _value(field: ParameterField, typed: Any) -> object:  # noqa: ANN401 - what click passes
    if field.option.is_choice:
        return field.option.chooses if typed else field.default
    return None if is_repeated(field) and not typed else typed


def _typed() -> frozenset[str]:
    """Return the names of the options on the command line."""
    context = click.get_current_context()
    source = context.get_parameter_source
    return frozenset(name for name in context.params if source(name) is ParameterSource.COMMANDLINE)
