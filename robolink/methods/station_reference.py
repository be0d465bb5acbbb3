"""Finds a station with a known tip: the reverse of finding a tip at a known station."""

import math
from collections.abc import Callable
from dataclasses import asdict
from typing import Final

from robolink.calibration import offset_sigma_mm
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.methods.beams import BeamsParameters
from robolink.methods.z_touch import ZTouchParameters, measure_z_touch
from robolink.model import Pose, ToolOffset, checks_arguments
from robolink.procedures import PinTouches, TouchPlan
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.runner import Procedure
from robolink.stations import Found, Station, StationKind, beam_station, touch_station

_MOST_APART_MM: Final = 0.3
"""Largest distance between two touches, in mm: each has a residual of half of it, at most the
largest residual of a touch."""


_USUAL: Final = TouchPlan()


@checks_arguments
def learn_station(
    station: Station,
    *,
    here: Pose,
    tool: int,
    tip: ToolOffset,
    sigma_mm: float | None = None,
    tip_sigma_mm: float = 0.0,
    plan: TouchPlan = _USUAL,
) -> Procedure[Found]:
    """Find where a station is. Runs in Tool 0, from above it.

    Args:
        station: What is known of it; beams and surfaces are sought about where it says.
        here: Where the flange is.
        tool: The tool whose tip is used.
        tip: Its offset, which is taken for right: what is wrong with it shifts the station.
        sigma_mm: Standard deviation of one coordinate of one touch, where it is known.
        tip_sigma_mm: Standard deviation of the tip's own offset. It puts the station as far off
            and shows in no touch, so it is added to what the station is unsure of.
        plan: How a pin is touched; nominal for a look ahead.

    Raises:
        CalibrationError: ``no_edge``, ``edge_passed``, ``not_touched``, ``typed_ahead``,
            ``touch_heights_differ``, ``touch_not_proven``, and those of the solvers.
        ConfigError: Nobody knows what the station switches, or about where it is; or it is a
            camera.

    Example:
        >>> from robolink.methods import learn_station
        >>> from robolink.model import Pose, ToolOffset
        >>> from robolink.stations import Station, StationKind
        >>> from robolink.testing import PaperCell
        >>> here, tip = Pose(300, 100, 20, 0), ToolOffset(12, -4, -20)
        >>> station = Station(id="PIN-07", kind=StationKind.PIN)
        >>> found = PaperCell(here, tip, (310, 95, -40)).run(
        ...     learn_station(station, here=here, tool=1, tip=tip, sigma_mm=0.02)
        ... )
        >>> round(found.x_mm, 3), round(found.y_mm, 3), round(found.z_mm, 3), found.sigma_mm
        (310.0, 95.0, -40.0, 0.02)
    """
    if station.kind is StationKind.CAMERA:
        raise ConfigError(
            tr("A camera is found together with a tip."),
            remedy=tr(
                "Measure both at once: {calibrate}",
                calibrate=remedy_word(
                    RemedyWord.CALIBRATE_CAMERA_AT, tool=tool, station=station.id
                ),
            ),
        )
    courses: dict[StationKind, Callable[[], Procedure[Found]]] = {
        StationKind.PIN: lambda: _pin(station, tool, tip, _with_tip(sigma_mm, tip_sigma_mm), plan),
        StationKind.BEAMS: lambda: _beams(station, here, tool, tip, tip_sigma_mm),
        StationKind.TOUCH: lambda: _surface(
            station, here, tool=tool, tip=tip, sigma_mm=sigma_mm, tip_sigma_mm=tip_sigma_mm
        ),
    }
    return courses[station.kind]()


def _with_tip(sigma_mm: float | None, tip_sigma_mm: float) -> float | None:
    """Return the uncertainty of a touched place; unknown if the touch's is."""
    return None if sigma_mm is None else math.hypot(sigma_mm, tip_sigma_mm)


def _pin(
    station: Station, tool: int, tip: ToolOffset, sigma_mm: float | None, plan: TouchPlan
) -> Procedure[Found]:
    """Touch the pin twice in one orientation; nothing would confirm one touch alone."""
    from robolink.calibration import pin_touched  # numpy, imported only when used

    touches = PinTouches(plan)
    first = yield from touches.first("first")
    second = yield from touches.again(
        first,
        key="second",
        turning=tr("Moving beside the pin."),
        instruction=tr("Jog the tip onto the pin once more."),
    )
    if not plan.nominal:
        touches.require_made()
        _require_same_place(first, second)
    one, other = pin_touched(first, tip), pin_touched(second, tip)
    return Found(
        id=station.id,
        kind=StationKind.PIN,
        x_mm=(one.x_mm + other.x_mm) / 2,
        y_mm=(one.y_mm + other.y_mm) / 2,
        z_mm=(one.z_mm + other.z_mm) / 2,
        sigma_mm=sigma_mm,
        how=tr("touched with tool {tool}", tool=tool),
        gauge=station.gauge,
        tool=tool,
        details={"z_from": "touched"},
    )


def _require_same_place(one: Pose, other: Pose) -> None:
    apart_mm = math.hypot(one.x_mm - other.x_mm, one.y_mm - other.y_mm)
    if apart_mm <= _MOST_APART_MM:
        return
    raise CalibrationError(
        "touch_not_proven",
        tr(
            "The two touches are {apart:.2f} mm apart: one of them was not on the pin.",
            apart=apart_mm,
        ),
        remedy=tr("Nothing was recorded. Jog the tip onto the same point both times."),
    )


def _beams(
    station: Station, here: Pose, tool: int, tip: ToolOffset, tip_sigma_mm: float
) -> Procedure[Found]:
    from robolink.methods.beams.procedure import trace_beams  # numpy, imported only when used

    guess = beam_station(station)
    beams = yield from trace_beams(
        guess, BeamsParameters(), here=here, tip=tip, tip_sigma_mm=tip_sigma_mm
    )
    lines = [
        {"input": number, **asdict(beam)} for number, beam in zip(guess.inputs, beams, strict=True)
    ]
    return Found(
        id=station.id,
        kind=StationKind.BEAMS,
        x_mm=None,
        y_mm=None,
        z_mm=guess.z_mm,
        how=tr("crossed with tool {tool}", tool=tool),
        gauge=station.gauge,
        tool=tool,
        details={"beams": lines, "off_when_broken": guess.off_when_broken},
    )


def _surface(
    station: Station,
    here: Pose,
    *,
    tool: int,
    tip: ToolOffset,
    sigma_mm: float | None,
    tip_sigma_mm: float,
) -> Procedure[Found]:
    guess = touch_station(station)
    found = yield from measure_z_touch(
        guess, ZTouchParameters(), here=here, stored=tip, sigma_mm=sigma_mm
    )
    return Found(
        id=station.id,
        kind=StationKind.TOUCH,
        x_mm=guess.x_mm,
        y_mm=guess.y_mm,
        # If the tip seems too long, the surface is higher than assumed.
        z_mm=guess.z_mm + tip.z_mm - found.offset.z_mm,
        # If the tip is longer than its offset says, the surface seems higher.
        sigma_mm=_with_tip(offset_sigma_mm(found), tip_sigma_mm),
        how=tr("touched with tool {tool}", tool=tool),
        gauge=station.gauge,
        tool=tool,
        details={"input": guess.input, "off_when_touched": guess.off_when_touched},
    )
