"""Cameras that see a tip: how one is opened by name, and how it is asked.

The cameras themselves are brought by other packages through the entry-point group
``robolink.sensors``; the simulated ones come through the same door.
"""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations
from statistics import median
from typing import Final, Protocol, cast
from urllib.parse import parse_qs, urlsplit

from robolink import runtime
from robolink.errors import CalibrationError, ConfigError, OutcomeUnknownError, StoppedError
from robolink.messages import joined, known_names, tr
from robolink.model import (
    TIP,
    Controller,
    ExplainsMisses,
    LookingController,
    LooksAtRest,
    Spot,
    SpotUnit,
    TipSensor,
    sensor_address,
)
from robolink.plug_ins import PlugInError, find_plug_in
from robolink.timing import NS_PER_S

__all__ = [
    "PATIENT_S",
    "SENSORS_GROUP",
    "SensorOpener",
    "UNSEEN",
    "VISION_GUIDE",
    "VisionGuideCamera",
    "median_spot",
    "open_sensor",
    "scatter_of",
    "seen_at_place",
    "seen_in",
    "seen_once",
    "sensor_name",
    "stale_picture",
]

_QUARTER_OF_DIFFERENCES: Final = 0.4506
"""Lower quartile of |a - b| for two normal numbers of standard deviation 1: 0.3186 sqrt(2)."""


def seen_once(sensor: TipSensor, mark: int, *, pictures: int) -> Spot:
    """Return where a camera sees a mark: the median of some pictures, in its own unit.

    The median, because one false detection among three pictures does not shift it far.

    Args:
        sensor: The camera.
        mark: What is looked for: ``TIP``, or the number of a fiducial.
        pictures: How many are taken.

    Raises:
        CalibrationError: ``tip_not_seen`` or ``fiducial_not_seen``: not in most of the pictures;
            ``several_tips_seen`` or ``several_fiducials_seen``: more than one at a time;
            ``non_finite``: the camera answers with something that is no place;
            ``sensor_failed``: it does not answer; and whatever the camera itself gives as the
            reason, such as ``tip_cut`` (:class:`~robolink.model.ExplainsMisses`).

    Example:
        >>> from types import SimpleNamespace
        >>> from robolink import Spot
        >>> from robolink.model import TIP
        >>> from robolink.sensing import seen_once
        >>> answers = iter([Spot(312.3, 96.3), Spot(312.4, 96.3), Spot(340.0, 96.3)])
        >>> camera = SimpleNamespace(see=lambda mark: [next(answers)], identity="a camera")
        >>> spot = seen_once(camera, TIP, pictures=3)
        >>> spot.x, spot.y
        (312.4, 96.3)
    """
    return median_spot(seen_in(sensor, mark, pictures=pictures))


def seen_in(sensor: TipSensor, mark: int, *, pictures: int) -> tuple[Spot, ...]:
    """Return where a camera sees a mark, in each of the pictures in which it does.

    Args:
        sensor: The camera.
        mark: What is looked for: ``TIP``, or the number of a fiducial.
        pictures: How many are taken.

    Raises:
        CalibrationError: As :func:`seen_once`.

    Example:
        >>> from types import SimpleNamespace
        >>> from robolink import Spot
        >>> from robolink.model import TIP
        >>> from robolink.sensing import seen_in
        >>> answers = iter([[Spot(312.3, 96.3)], [], [Spot(312.4, 96.3)]])
        >>> camera = SimpleNamespace(see=lambda mark: next(answers), identity="a camera")
        >>> [spot.x for spot in seen_in(camera, TIP, pictures=3)]
        [312.3, 312.4]
    """
    spots = list[Spot]()
    for found in _looked(sensor, mark, pictures):
        if len(found) > 1:
            raise _several(mark, found)
        for spot in found:
            _require_finite(spot, sensor)
        spots += found
    if 2 * len(spots) <= pictures:
        raise _not_seen(mark, sensor, len(spots), pictures)
    return tuple(spots)


def seen_at_place(
    sensor: TipSensor, mark: int, pictures: int, wait: Callable[[], None]
) -> tuple[Spot, ...]:
    """Return what :func:`seen_in` returns, of a mark that has to be in the picture.

    A camera that works on pictures of its own and does not see it is asked again, a bounded number
    of times: what comes later and stays shows that pictures are late.

    Args:
        sensor: The camera.
        mark: What is looked for.
        pictures: How many are taken.
        wait: Lets the time pass that the camera needs before a look.

    Raises:
        CalibrationError: As :func:`seen_in`; ``stale_picture``.
    """
    try:
        return seen_in(sensor, mark, pictures=pictures)
    except CalibrationError as error:
        if error.code in _NOT_THERE and isinstance(sensor, LooksAtRest):
            _require_on_time(sensor, mark, wait)
        raise


def _require_on_time(sensor: TipSensor, mark: int, wait: Callable[[], None]) -> None:
    """Refuse the pictures of a camera that did not see a mark and sees it now."""
    begun_ns, seen, late = runtime.monotonic_ns(), 0, None
    for _ in range(_REPEATED_LOOKS):
        wait()
        try:
            seen_in(sensor, mark, pictures=1)
        except CalibrationError as error:
            if error.code not in UNSEEN:
                raise
            seen = 0
            continue
        late = late if seen and late else stale_picture(begun_ns)
        seen += 1
        if seen == _STAYS:
            raise late


def stale_picture(since_ns: int) -> CalibrationError:
    """Return the refusal of pictures that show where the robot was before.

    Args:
        since_ns: Reading of :func:`robolink.runtime.monotonic_ns` when the robot had stopped.
    """
    lag_s = (runtime.monotonic_ns() - since_ns) / NS_PER_S
    return CalibrationError(
        "stale_picture",
        tr(
            "The pictures are old: the camera showed the tip's new place {lag:.1f} s after the "
            "robot had stopped.",
            lag=lag_s,
        ),
        remedy=tr(
            "Let the camera deliver single pictures instead of a buffered stream, or learn the "
            "station, which measures the delay."
        ),
    )


_NOT_THERE: Final = frozenset(
    {"tip_not_seen", "fiducial_not_seen", "tip_cut", "out_of_focus"}
    | {"picture_dark", "picture_overexposed"}
)

UNSEEN: Final = _NOT_THERE | {"several_tips_seen", "several_fiducials_seen"}
"""Refusals of a look that say nothing of another place, or of a later picture."""

PATIENT_S: Final = 0.5
"""Least time between two looks that are repeated, in s: eight of them cover a delay of 4 s."""

_REPEATED_LOOKS: Final = 8
_STAYS: Final = 3
"""Looks in a row in which a mark has to be seen that was not seen when the robot arrived."""


def median_spot(spots: Sequence[Spot]) -> Spot:
    """Return the median of each number of some spots; ``None`` for a number that none has."""
    radii = [spot.radius_px for spot in spots if spot.radius_px is not None]
    scores = [spot.score for spot in spots if spot.score is not None]
    return Spot(
        median(spot.x for spot in spots),
        median(spot.y for spot in spots),
        radius_px=median(radii) if radii else None,
        score=median(scores) if scores else None,
    )


def scatter_of(spots: Sequence[Spot]) -> float | None:
    """Return the standard deviation of one coordinate of one picture, ``None`` for one picture.

    From the lower quartile of the differences between any two, so that one false find among three
    pictures does not make the scatter of the others seem large.
    """
    differences = sorted(
        difference
        for one, other in combinations(spots, 2)
        for difference in (abs(one.x - other.x), abs(one.y - other.y))
    )
    if not differences:
        return None
    return differences[len(differences) // 4] / _QUARTER_OF_DIFFERENCES


def _looked(sensor: TipSensor, mark: int, pictures: int) -> Iterator[Sequence[Spot]]:
    """Yield what is seen in each picture.

    Covers anything that a camera's driver raises: an error must neither leave the tip down in front
    of the lens, nor be mistaken for a failure of the controller's link. A stop and an unknown
    outcome keep their own types, because a camera that is read through the controller can raise
    both; and what a camera refuses by name keeps that name.
    """
    try:
        if isinstance(sensor, LooksAtRest):
            yield from sensor.look_at_rest(mark, pictures)
            return
        for _ in range(pictures):
            yield sensor.see(mark)
    except (CalibrationError, StoppedError, OutcomeUnknownError):
        raise
    except Exception as error:
        raise CalibrationError(
            "sensor_failed",
            tr("Camera {camera} failed: {cause}", camera=sensor.identity, cause=error),
            remedy=tr("Check cable, power and program of the camera, then start again."),
        ) from error


def _require_finite(spot: Spot, sensor: TipSensor) -> None:
    # Checked before any calculation: the next movement would depend on it.
    finite = math.isfinite(spot.x) and math.isfinite(spot.y)
    radius_px = spot.radius_px
    if finite and (radius_px is None or (math.isfinite(radius_px) and radius_px > 0)):
        return
    told = tr("{camera} answers {x}, {y}.", camera=sensor.identity, x=spot.x, y=spot.y)
    if finite:
        told = tr(
            "{camera} answers with a spot of radius {radius} px.",
            camera=sensor.identity,
            radius=radius_px,
        )
    raise CalibrationError(
        "non_finite",
        told,
        remedy=tr("Restart the camera's program, and check what it finds in its picture."),
    )


def _not_seen(mark: int, sensor: TipSensor, seen: int, pictures: int) -> CalibrationError:
    explained = sensor.why_unseen(mark) if isinstance(sensor, ExplainsMisses) else None
    if explained is not None:
        return explained
    where = tr(
        "{camera}: seen in {seen} of {pictures} pictures.",
        camera=sensor.identity,
        seen=seen,
        pictures=pictures,
    )
    if mark == TIP:
        return CalibrationError(
            "tip_not_seen",
            tr("The camera does not see the tip. {where}", where=where),
            remedy=tr("Check light, lens and focus; clean the tip; check where the camera looks."),
        )
    return CalibrationError(
        "fiducial_not_seen",
        tr("The camera does not see fiducial {mark}. {where}", mark=mark, where=where),
        remedy=tr("Check light and focus, the drawing, and that the board is held as drawn."),
    )


def _several(mark: int, found: Sequence[Spot]) -> CalibrationError:
    places = ", ".join(f"({spot.x:.1f}, {spot.y:.1f})" for spot in found)
    if mark == TIP:
        return CalibrationError(
            "several_tips_seen",
            tr("The camera sees {count} tips, at {places}.", count=len(found), places=places),
            remedy=tr(
                "Only one may be in the image: retract the other nozzle, clean the window, or make "
                "the field of view smaller."
            ),
        )
    return CalibrationError(
        "several_fiducials_seen",
        tr(
            "The camera sees {count} marks that may be fiducial {mark}, at {places}.",
            count=len(found),
            mark=mark,
            places=places,
        ),
        remedy=tr("Only one may be in the image; make the field of view smaller."),
    )


VISION_GUIDE: Final = "vision-guide"

PROGRAM: Final = 7
"""Number of the function main7; every version of RC+ can start it (docs/reference/epson.md 1.2)."""

SETTLE_S: Final = 0.2
"""Time that the robot is stopped before a look, in s (assumed)."""

_HIGHEST_PROGRAM: Final = 63


class VisionGuideCamera:
    """Implements :class:`~robolink.model.TipSensor` and ``ControllerSensor``.

    It answers in millimetres of the base: the sequences have a calibration.

    Args:
        program: Number of the function that takes a look.
        controller: Who has it; none until it is known.
    """

    def __init__(self, program: int = PROGRAM, controller: LookingController | None = None) -> None:
        self._program = program
        self._controller = controller

    @property
    def identity(self) -> str:
        """Its name, and its controller."""
        whose = f" of {self._controller.identity}" if self._controller else ""
        return f"{VISION_GUIDE}?program={self._program}{whose}"

    @property
    def unit(self) -> SpotUnit:
        """Millimetres of the base."""
        return SpotUnit.BASE_MM

    @property
    def resolution_px(self) -> tuple[int, int] | None:
        """Irrelevant: it answers in millimetres."""
        return None

    @property
    def settle_s(self) -> float:
        """Seconds of the controller's clock."""
        return SETTLE_S

    def beside(self, controller: Controller) -> "VisionGuideCamera":
        """Return it as a connected controller shows it; reads only.

        Raises:
            ConfigError: This kind has no vision system, or its project no program for it.
        """
        if not isinstance(controller, LookingController):
            raise ConfigError(
                tr("{controller} has no vision system of its own.", controller=controller.identity),
                remedy=tr("Name another camera; this one is for EPSON controllers."),
            )
        controller.require_looks()
        return VisionGuideCamera(self._program, controller)

    def see(self, mark: int = TIP) -> Sequence[Spot]:
        """Take a look; see :class:`~robolink.model.TipSensor`.

        Raises:
            ConfigError: It is not known which controller it belongs to.
        """
        if self._controller is None:
            raise ConfigError(
                tr("{camera} works through its controller only.", camera=VISION_GUIDE),
                remedy=tr("Use it in a calibration of that controller."),
            )
        return self._controller.look(mark, program=self._program)

    def close(self) -> None:
        """Nothing was opened."""


def open_vision_guide(url: str) -> VisionGuideCamera:
    """Open the camera that a text names; nothing is sent yet.

    Raises:
        ConfigError: An option is unknown, or no number of a function.
    """
    options = parse_qs(urlsplit(url).query, keep_blank_values=True)
    text = options.pop("program", [str(PROGRAM)])[-1]
    known = text.isascii() and text.isdecimal() and int(text) <= _HIGHEST_PROGRAM
    if options or not known:
        raise ConfigError(
            tr("{url!r} names no camera of a vision system.", url=url),
            remedy=tr("Write vision-guide, or vision-guide?program=N with N from 0 to 63."),
        )
    return VisionGuideCamera(int(text))


SENSORS_GROUP: Final = "robolink.sensors"

_OWN_EYE: Final = "robolink.eye."
"""Beginning of the modules whose cameras are named by the address of their pictures."""

_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9+._-]*(?=://|\?|$)", re.ASCII)


class SensorOpener(Protocol):
    """What an entry point of the group provides."""

    def __call__(self, url: str) -> TipSensor:
        """Open the camera that ``url`` names.

        Raises:
            ConfigError: The rest of the URL makes no sense.
            ConnectError: The camera is not there.
        """


@contextmanager
def open_sensor(url: str | TipSensor) -> Iterator[TipSensor]:
    """Open a camera, and release it at the end of the block.

    Args:
        url: For example ``assist+tcp://TOKEN@127.0.0.1:40001`` or the name of a plug-in. A
            camera that is open already is used as it is, and left open for whoever opened it.

    Raises:
        CalibrationError: ``sensor_not_found``: nothing of that name is installed.
        ConfigError: The rest of the URL makes no sense.
        ConnectError: The camera is not there.
    """
    if not isinstance(url, str):
        yield url
        return
    sensor = _opener(url)(url)
    try:
        yield sensor
    finally:
        sensor.close()


def sensor_name(sensor: str | TipSensor) -> str:
    """Return the camera's name in a sentence or a record: its name, or its own identity.

    What is secret in a URL is left out; see :func:`robolink.model.sensor_address`.
    """
    return sensor_address(sensor if isinstance(sensor, str) else sensor.identity)


def _opener(url: str) -> SensorOpener:
    name = _NAME.match(url)
    if name and name[0] == VISION_GUIDE:
        return open_vision_guide
    try:
        found = find_plug_in(SENSORS_GROUP, name[0]) if name else None
    except PlugInError as error:
        raise CalibrationError(
            "sensor_not_found",
            tr(
                "The sensor {url!r} cannot be loaded: {cause}.",
                url=sensor_name(url),
                cause=error,
            ),
            remedy=tr("Reinstall the package that provides it."),
        ) from error.origin
    if found is None:
        from importlib import metadata  # slower to import than the rest of this package

        entries = metadata.entry_points(group=SENSORS_GROUP)
        own = sorted({f"{entry.name}://" for entry in entries if entry.value.startswith(_OWN_EYE)})
        known = {entry.name for entry in entries if not entry.value.startswith(_OWN_EYE)}
        raise CalibrationError(
            "sensor_not_found",
            tr("No sensor is called {url!r}.", url=sensor_name(url)),
            remedy=joined(
                " ",
                (
                    known_names(sorted(known | {VISION_GUIDE}), sensor_name(url)),
                    tr(
                        "Or give the address of a picture ({schemes}), or install a package.",
                        schemes=", ".join(own),
                    ),
                ),
            ),
        )
    return cast(SensorOpener, found)
