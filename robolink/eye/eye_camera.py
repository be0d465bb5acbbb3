"""A camera that finds tips: pictures of a source, and a finder on each of them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Final

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.candidate import Candidate, MarkFinder
from robolink.eye.finders import finder_of
from robolink.eye.kept_pictures import KeptLook, LookRole, PictureStore
from robolink.eye.misses import miss
from robolink.eye.picture import CameraPicture
from robolink.eye.settings import EyeSettings
from robolink.eye.source import PictureSource
from robolink.messages import tr
from robolink.model import TIP, Spot, SpotUnit
from robolink.timing import Clock, Deadline, SystemClock

__all__ = ["EyeCamera", "EyeLook"]

SETTLE_S: Final = 0.2
"""Time for which the robot stands still before the first exposure, in s (assumed)."""

PATIENCE_S: Final = 3.0
"""How long pictures are taken until two differ in their bytes, or agree in what they show."""

_LEAST_TRIES: Final = 4
"""Pictures that are taken in any case before a source counts as stuck or restless."""

_RETRY_S: Final = 0.05
"""Pause before a source is asked again that delivered the same picture."""

AGREE_PX: Final = 1.0
"""How far apart one thing may be found in two pictures of a robot that stands still, in pixels."""

_AGREE_SHARE: Final = 0.03
"""The same as a share of its radius; the larger of the two counts."""

WIDE_EDGE_PX: Final = 3.0
"""Width of an edge above which a tip may be out of focus, where nobody taught what it is in focus,
in pixels: drawn tips have 2.3 to 2.6, and 3.6 where they are 0.5 mm too high."""

FinderOf = Callable[[int, EyeSettings], MarkFinder]
"""Returns the finder of a mark: the tip, or a fiducial by its number."""


@dataclass(frozen=True, slots=True)
class EyeLook:
    """One picture, and what was found in it.

    Attributes:
        picture: The picture.
        mark: What was looked for.
        candidates: All that may be it, the accepted ones first.
    """

    picture: CameraPicture
    mark: int
    candidates: tuple[Candidate, ...]

    @property
    def accepted(self) -> tuple[Candidate, ...]:
        """What was found."""
        return tuple(one for one in self.candidates if one.accepted)

    @property
    def spots(self) -> tuple[Spot, ...]:
        """The same, as procedures use it."""
        return tuple(
            Spot(one.x_px, one.y_px, radius_px=one.radius_px, score=one.score)
            for one in self.accepted
        )

    def agrees(self, other: "EyeLook") -> bool:
        """Return whether two pictures show the same things at the same places."""
        if len(self.accepted) != len(other.accepted):
            return False
        return all(any(_near(one, another) for another in other.accepted) for one in self.accepted)


class EyeCamera:
    """Implements :class:`~robolink.model.TipSensor` by pictures of any source.

    It is a ``StationSensor`` and ``LooksAtRest``, and tells misses and doubts. A picture whose
    bytes or pixels are those of the one before is not used. For each look pictures are taken until
    as many in a row as count, and at least two, agree in what they show. What this does not show,
    the known movement of the robot does
    (docs/decisions/0071-a-finder-that-refuses.md).

    Args:
        source: Where the pictures come from; it is closed with the camera.
        settings: What is known of the tip and the camera.
        finder_of: Returns the finder of a mark.
        store: Where pictures are kept; ``None`` for nowhere.
        clock: What is waited on between two pictures.
    """

    def __init__(
        self,
        source: PictureSource,
        settings: EyeSettings | None = None,
        *,
        finder_of: FinderOf = finder_of,
        store: PictureStore | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.source = source
        self.settings = settings or EyeSettings()
        self._finder_of = finder_of
        self._store = store
        self._clock = clock or SystemClock()
        self._station = ""
        self._change = ""
        self._before: CameraPicture | None = None
        self._unseen: EyeLook | None = None
        self._first: EyeLook | None = None
        self._last: EyeLook | None = None
        self._at_stations = list[EyeCamera]()
        self._size_px: tuple[int, int] | None = None
        self._edges_px = list[float]()

    @property
    def identity(self) -> str:
        """Which camera this is, without a user or a password."""
        return self.source.identity

    @property
    def unit(self) -> SpotUnit:
        """Pixels."""
        return SpotUnit.PIXEL

    @property
    def resolution_px(self) -> tuple[int, int] | None:
        """Width and height of its pictures, ``None`` before the first one."""
        return self._size_px

    @property
    def settle_s(self) -> float:
        """Seconds that the robot stands still before a look, with what the source is late."""
        return SETTLE_S + self.settings.lag_s

    def at_station(self, details: Mapping[str, object], mm_per_px: float | None) -> "EyeCamera":
        """Return it for a station; see :class:`~robolink.model.StationSensor`.

        Raises:
            ConfigError: Nobody stated how wide the tip is; or a value is wrong.
            CalibrationError: With one of :data:`~robolink.eye.source.CAMERA_CODES`.
        """
        settings = EyeSettings.of(details, mm_per_px=mm_per_px)
        station = str(details.get("station", ""))
        if settings.radius_px is None and settings.mark_mm is None:
            raise _unknown_width(station, settings)
        camera = EyeCamera(
            self.source,
            settings,
            finder_of=self._finder_of,
            store=self._store,
            clock=self._clock,
        )
        camera._station = station
        camera._change = self._change
        self._at_stations.append(camera)
        if settings.exposure_us is not None:
            self.source.expose(settings.exposure_us)
        camera._fresh()  # it answers, before anything moves
        return camera

    def of_change(self, change: str) -> None:
        """Note for which change pictures are taken; see :class:`~robolink.model.KeepsPictures`."""
        self._change = change

    def see(self, mark: int = TIP) -> Sequence[Spot]:
        """Return what one fresh picture shows; see :class:`~robolink.model.TipSensor`.

        Raises:
            ConfigError, CalibrationError: As :meth:`look_at_rest`.
        """
        return self.look_at_rest(mark, 1)[0]

    def look_at_rest(self, mark: int, pictures: int) -> Sequence[Sequence[Spot]]:
        """Return what so many pictures show; see :class:`~robolink.model.LooksAtRest`.

        Raises:
            ConfigError: Nobody stated how wide the tip is: without that a finder guesses, which is
                for teaching only, with :meth:`looks`.
            CalibrationError: With one of :data:`~robolink.eye.source.CAMERA_CODES`.
        """
        if mark == TIP and self.settings.radius_px is None:
            raise _unknown_width(self._station, self.settings)
        self._unseen = None
        looks = self.looks(mark, pictures)
        for look in looks:
            self._remember(look)
        return [look.spots for look in looks]

    def looks(self, mark: int, pictures: int) -> list[EyeLook]:
        """Return pictures of a robot that stands still, and all candidates in them.

        Args:
            mark: What is looked for.
            pictures: How many.

        Raises:
            CalibrationError: With one of :data:`~robolink.eye.source.CAMERA_CODES`.
        """
        for _ in range(self.settings.lag_pictures):
            self._fresh()
        taken = [self.glance(mark)]
        agreeing, wanted = 1, max(pictures, 2)
        deadline = Deadline.after(self._clock, PATIENCE_S)
        while agreeing < wanted:
            if len(taken) >= wanted + _LEAST_TRIES and deadline.expired:
                self._require_rest(taken)
                break
            taken.append(self.glance(mark))
            agreeing = agreeing + 1 if taken[-1].agrees(taken[-2]) else 1
        return taken[-pictures:]

    def glance(self, mark: int = TIP) -> EyeLook:
        """Return one picture and all candidates in it, whatever the pictures before showed.

        Raises:
            CalibrationError: With one of :data:`~robolink.eye.source.CAMERA_CODES`.
        """
        picture = self._fresh()
        return EyeLook(picture, mark, tuple(self._finder_of(mark, self.settings)(picture)))

    def why_unseen(self, mark: int) -> CalibrationError | None:
        """Return why a mark was not seen; see :class:`~robolink.model.ExplainsMisses`."""
        look = self._unseen
        if look is None or look.mark != mark:
            return None
        return miss(look.picture, look.candidates, self.identity, mark=mark)

    def doubts(self) -> tuple[str, ...]:
        """Return ``focus_not_taught`` where that is so; see :class:`~robolink.model.NamesDoubts`.

        That is, where the edge of the tip is wide and no width was taught to compare it with.
        """
        wide = self.settings.edge_px is None and median(self._edges_px or [0.0]) > WIDE_EDGE_PX
        return ("focus_not_taught",) if wide else ()

    def close(self) -> None:
        """Release the camera, and keep the last picture of its looks, of each station."""
        for camera in (self, *self._at_stations):
            camera.keep_last()
        self.source.close()

    def keep_last(self) -> None:
        """Keep the last picture in which the mark was seen, once."""
        if self._last is not None:
            self._keep(LookRole.LAST, self._last)
            self._last = None

    def _fresh(self) -> CameraPicture:
        """Return a picture that is not the one before.

        Raises:
            CalibrationError: ``stale_picture``: it is, again and again; ``camera_changed``: its
                size is another; those of the source.
        """
        deadline, tries = Deadline.after(self._clock, PATIENCE_S), 0
        while True:
            picture, tries = self.source.take(), tries + 1
            self._require_size(picture)
            if not _same(picture, self._before):
                self._before = picture
                return picture
            if tries >= _LEAST_TRIES and deadline.expired:
                refused = _stuck(self.identity, tries)
                self._keep(LookRole.REFUSED, EyeLook(picture, TIP, ()), refused.code)
                raise refused
            self._clock.sleep(_RETRY_S)

    def _require_size(self, picture: CameraPicture) -> None:
        if self._size_px is None:
            self._size_px = picture.size_px
        if picture.size_px != self._size_px:
            (was_x, was_y), (x, y) = self._size_px, picture.size_px
            raise CalibrationError(
                "camera_changed",
                tr(
                    "{camera} delivers pictures of {x} x {y} pixels, and before of {a} x {b}.",
                    camera=self.identity,
                    x=x,
                    y=y,
                    a=was_x,
                    b=was_y,
                ),
                remedy=tr("Let no other program change the camera; then start again."),
            )

    def _require_rest(self, taken: Sequence[EyeLook]) -> None:
        """Refuse pictures that each show one thing, and each at another place.

        Raises:
            CalibrationError: ``stale_picture``.
        """
        last = taken[-_LEAST_TRIES:]
        if any(len(look.accepted) != 1 for look in last):
            return  # none or several: whoever asked refuses those by name
        self._keep(LookRole.REFUSED, last[-1], "stale_picture")
        raise CalibrationError(
            "stale_picture",
            tr(
                "{count} pictures of {camera} show the tip at different places while the robot "
                "stands still.",
                count=len(taken),
                camera=self.identity,
            ),
            remedy=tr("Check the camera's mount and its delay: pictures may come late."),
        )

    def _remember(self, look: EyeLook) -> None:
        if len(look.accepted) == 1:
            if look.accepted[0].edge_px is not None:
                self._edges_px.append(look.accepted[0].edge_px)
            if self._first is None:
                self._first = look
                self._keep(LookRole.FIRST, look)
            self._last = look
            if self._store is not None:
                self._store.show(self._noted(LookRole.LAST, look), look.picture)
            return
        if not look.accepted:
            self._unseen = look
            reason = miss(look.picture, look.candidates, self.identity, mark=look.mark)
            self._keep(LookRole.REFUSED, look, reason.code if reason else "tip_not_seen")
        else:
            self._keep(LookRole.REFUSED, look, "several_tips_seen")

    def _keep(self, role: LookRole, look: EyeLook, code: str = "") -> None:
        if self._store is not None:
            kept = self._noted(role, look, code)
            self._store.keep(kept, look.picture)
            self._store.show(kept, look.picture)

    def _noted(self, role: LookRole, look: EyeLook, code: str = "") -> KeptLook:
        return KeptLook(
            role=role,
            code=code,
            camera=self.identity,
            station=self._station,
            mark=look.mark,
            candidates=look.candidates,
            change=self._change,
        )


def _near(one: Candidate, other: Candidate) -> bool:
    apart_px = math.dist((one.x_px, one.y_px), (other.x_px, other.y_px))
    return apart_px <= max(AGREE_PX, _AGREE_SHARE * one.radius_px)


def _same(picture: CameraPicture, before: CameraPicture | None) -> bool:
    """Return whether a picture is the one before; no two exposures of a camera are equal.

    Except where there is nothing in them: a closed shutter, or light that is much too strong.
    """
    import numpy as np

    if before is None or picture.size_px != before.size_px:
        return False
    grey = picture.grey
    if not (picture.digest and picture.digest == before.digest) and not np.array_equal(
        grey, before.grey
    ):
        return False
    return bool(np.any((grey > _BLACK) & (grey < _WHITE)))


_BLACK: Final = 2
_WHITE: Final = 253


def _stuck(camera: str, tries: int) -> CalibrationError:
    return CalibrationError(
        "stale_picture",
        tr("{camera} delivered the same picture {tries} times.", camera=camera, tries=tries),
        remedy=tr("Restart the camera or the program that hands out its pictures."),
    )


def _unknown_width(station: str, settings: EyeSettings) -> ConfigError:
    if settings.diameter_mm is not None:
        return ConfigError(
            tr(
                "The tip is {mm:g} mm wide, but the length of a pixel is unknown at {station}.",
                mm=settings.diameter_mm,
                station=station or tr("this station"),
            ),
            remedy=tr("Learn the station: robolink cell station learn."),
        )
    return ConfigError(
        tr(
            "It is not known how wide the tip is that the camera at {station} looks for.",
            station=station or tr("this station"),
        ),
        remedy=tr("State diameter_mm in the cell file and learn it: robolink cell station learn."),
    )
