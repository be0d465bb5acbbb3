"""How marks are moved before a camera."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from robolink.calibration import carrying, tip_did_not_move, toward_zero
from robolink.errors import CalibrationError, ConfigError
from robolink.messages import tr
from robolink.model import TIP, Path, Pose, SpotUnit, ToolOffset
from robolink.procedures.camera_watch import SpotWatch
from robolink.procedures.picture_lateness import LookAgain, PictureLateness
from robolink.runner import Look, Move, Notify, Procedure, SeenAt, first_clear
from robolink.sensing import UNSEEN
from robolink.stations import CameraStation

HALF_ROUND_DEG: Final = (0.0, 60.0, 120.0, 180.0)
"""Four angles over half a turn, degrees: joints that allow any turn about a tip allow these. A
whole turn would give 0.50 sigma instead of 0.55. Each step is less than half a turn, so that the
controller has only one way to turn, and all are in one direction."""

TWO_ANGLES_DEG: Final = (0.0, 120.0)
"""Two angles that separate the camera's own error from the tool."""

LEAST_BESIDE_MM: Final = 0.2
"""Smallest distance from its place at which an approach begins, in mm; from nearer, it is not clear
if the spot moves with the tip."""


@dataclass(frozen=True, slots=True)
class LookPlan:
    """How marks are moved before a camera.

    Attributes:
        turns_deg: Angles U of the looks, counted toward zero from where the tool stands.
        pictures: How many are taken at each; the median counts.
        lift_mm: How far the mark is lifted before anything turns.
        centre_first: Look once to find the mark, and bring it to the middle for the measurement:
            there an error of the camera's scale, or of the height, does no harm.
        search_mm: How far from where it is expected the first look may find the mark; the robot
            does not follow anything farther.
        beside_mm: Every place is approached from this far beside it in X and Y, always from the
            same side, so that play in the joints shifts all looks alike. A picture is taken there
            too: a spot that does not move from there as the robot does is not the tip.
    """

    turns_deg: tuple[float, ...] = HALF_ROUND_DEG
    pictures: int = 3
    lift_mm: float = 10.0
    centre_first: bool = True
    search_mm: float = 5.0
    beside_mm: float = 1.0

    def angles_deg(self, u_deg: float) -> tuple[float, ...]:
        """Return U of every look for a tool that stands at ``u_deg``, in order."""
        return tuple(toward_zero(u_deg, turn_deg) for turn_deg in self.turns_deg)


_SHARES: Final = (1.0, -1.0, 0.5, -0.5)
"""Factors for the planned turns, tried in this order if the arm cannot make the turns."""

_NEARER: Final = (1.0, 0.5, 0.25)
"""Shares of the distance beside a place, tried in turn if the spot is not seen at the full
distance."""


_UNEXPLAINED: Final = frozenset({"tip_not_seen", "fiducial_not_seen"})
"""Refusals of a picture beside a place that give no reason of their own."""


@dataclass(frozen=True, slots=True)
class Place:
    """Something to look at.

    Attributes:
        u_deg: U of the frame meanwhile.
        mark: The tip, or the number of a fiducial.
        at: Where the mark is expected, seen from the frame.
        aside_mm: How far from the middle of the image it is brought, base X and Y.
    """

    u_deg: float
    at: ToolOffset
    mark: int = TIP
    aside_mm: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class CameraDrive:
    """The movement of one frame from place to place, and whether the spot moves with it.

    Each place is looked at twice: from beside it, where its approach begins anyway, and at it. A
    spot that is the tip moves by what the robot moved meanwhile; one that does not is met once
    more, from the same side both times and with all pictures, and refused if it still does not.

    Attributes:
        station, plan: Where and how.
        frame: A pose of the frame: its V and W, hand, local and tool.
        calibrated: Whether it is known what the pixels mean; not where that is measured.
        watch: What the looks said so far of the camera itself.

    Raises:
        ConfigError: The plan begins approaches too near to the places for that.
    """

    station: CameraStation
    plan: LookPlan
    frame: Pose
    calibrated: bool = True
    watch: SpotWatch = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Begin a run of looks."""
        if self.plan.beside_mm < LEAST_BESIDE_MM:
            raise ConfigError(
                tr(
                    "An approach that begins {beside:g} mm beside its place does not show whether "
                    "the spot moves with the tip.",
                    beside=self.plan.beside_mm,
                ),
                remedy=tr("Let it begin {least:g} mm beside or more.", least=LEAST_BESIDE_MM),
            )
        object.__setattr__(self, "watch", SpotWatch(self.station, self.calibrated))

    def looks(
        self, places: Sequence[Place], here: Pose, *, before_camera: bool = False
    ) -> Procedure[list[SeenAt]]:
        """Look at every place in turn; ends before the camera, with the last one in the image.

        Args:
            places: What to look at.
            here: Where the frame is.
            before_camera: Whether it stands where an earlier call ended.

        Raises:
            CalibrationError: ``tip_not_seen``, ``several_tips_seen`` and their like;
                ``tip_did_not_move``, ``camera_changed``, ``spot_changed``, ``stale_picture``; with
                the frame lifted.

        Example:
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.procedures import CameraDrive, LookPlan, Place
            >>> from robolink.stations import CameraStation
            >>> from robolink.testing import PaperCell
            >>> here, tip = Pose(300, 100, 20, 0), ToolOffset(12, -4, -20)
            >>> drive = CameraDrive(CameraStation(300, 80, -30), LookPlan(), here)
            >>> seen = PaperCell(here, tip).run(drive.looks([Place(0, tip), Place(90, tip)], here))
            >>> [(look.u_deg, round(look.spot.x, 3), round(look.spot.y, 3)) for look in seen]
            [(0, 300.0, 80.0), (90, 300.0, 80.0)]
        """
        seen = list[SeenAt]()
        for place in places:
            if before_camera and place.u_deg == here.u_deg:
                yield Move(
                    self._beside(place),
                    Path.STRAIGHT,
                    tr("Moving to the next place over the camera."),
                )
            else:
                yield from self._turn_to(place, here)
            beside = yield from self._look_beside(place)
            here, before_camera = self.pose(place), True
            yield from self._approach(here)
            try:
                look = yield from self._look(place)
            except CalibrationError:
                yield from self.lifted(place)
                raise
            seen.append((yield from self._witnessed(place, beside, look)))
        return seen

    def _witnessed(self, place: Place, beside: SeenAt | None, look: SeenAt) -> Procedure[SeenAt]:
        """Return a look whose spot is confirmed to have moved with the robot.

        Raises:
            CalibrationError: ``tip_did_not_move``, ``camera_changed``, ``spot_changed``,
                ``stale_picture``.
        """
        approach_mm = math.hypot(self.plan.beside_mm, self.plan.beside_mm)
        lateness = PictureLateness(self.watch, approach_mm)
        try:
            return (yield from self._followed(place, beside, look, lateness))
        except CalibrationError as error:
            yield from self.lifted(place)
            reason = lateness.reason(error)
            if reason is error:
                raise
            raise reason from error

    def _followed(
        self, place: Place, beside: SeenAt | None, look: SeenAt, lateness: PictureLateness
    ) -> Procedure[SeenAt]:
        watch, mark = self.watch, place.mark
        if beside is None or not watch.follows(mark, beside, look):
            again = self._looks_again(place, self.pose(place))
            yield from lateness.of_a_spot(mark, beside, look, again)
            pair = yield from self._more_closely(place, lateness)
            # In pixels, movements are only compared with each other: all may be late.
            if lateness.found is not None and not watch.in_mm(look):
                raise lateness.found
            if beside is not None:
                watch.learn_play(beside, look)
            beside, look = pair
        earlier = watch.known_before(mark, place.u_deg, look)
        if earlier is not None and not watch.follows(mark, earlier, look):
            pair = yield from self._again(place, earlier, lateness)
            if not watch.follows(mark, *pair):
                raise watch.refusal(mark, [(earlier, look), pair])
            look = pair[1]
        watch.keep(mark, place.u_deg, beside, look)
        return look

    def _looks_again(self, place: Place, at: Pose) -> LookAgain:
        def again() -> Procedure[SeenAt | None]:
            now: SeenAt | None = yield from self._seen(place, at, 1, repeated=True)
            return now

        return again

    def _more_closely(
        self, place: Place, lateness: PictureLateness
    ) -> Procedure[tuple[SeenAt, SeenAt]]:
        """Look beside a place and at it with all pictures, both approached from the same side.

        From nearer where nothing is seen at the whole distance, and where what is seen moves by
        another vector: a camera that changed shows that one wrong in the same way.

        Raises:
            CalibrationError: ``tip_did_not_move``, ``camera_changed``, ``spot_changed``;
                ``several_tips_seen`` and its like.
        """
        yield Notify(_in_doubt())
        wrong = list[tuple[SeenAt, SeenAt]]()
        unseen = tip_did_not_move(None, in_mm=False)
        at, watch = self.pose(place), self.watch
        for share in _NEARER:
            start = _shifted(at, -share * self.plan.beside_mm)
            yield from self._met(start)
            try:
                before: SeenAt = yield from self._seen(place, start, self.plan.pictures)
            except CalibrationError as error:
                if error.code not in UNSEEN:
                    raise
                unseen = unseen if error.code in _UNEXPLAINED else error
                continue
            yield from lateness.at_rest(before, self._looks_again(place, start))
            yield from self._approach(at)
            pair = before, (yield from self._look(place))
            # A shorter distance has a wider tolerance: what was wrong over the full distance must
            # not become right because of that.
            if watch.follows(place.mark, *pair) and not any(
                watch.alike(pair, other) for other in wrong
            ):
                return pair
            yield from lateness.at_rest(pair[1], self._looks_again(place, at))
            wrong.append(pair)
            if len(wrong) == 2 or watch.stands_still(place.mark, *pair):
                break
        raise watch.refusal(place.mark, wrong) if wrong else unseen

    def _again(
        self, place: Place, earlier: SeenAt, lateness: PictureLateness
    ) -> Procedure[tuple[SeenAt, SeenAt]]:
        """Look where a mark was seen before, and at its place, both approached from one side."""
        start, at = self._at_place(place, earlier), self.pose(place)
        yield Notify(_in_doubt())
        yield from self._met(start)
        before = yield from self._seen(place, start, self.plan.pictures)
        yield from lateness.at_rest(before, self._looks_again(place, start))
        yield from self._met(at)
        return before, (yield from self._look(place))

    def _at_place(self, place: Place, earlier: SeenAt) -> Pose:
        return replace(self.pose(place), x_mm=earlier.x_mm, y_mm=earlier.y_mm)

    def _met(self, at: Pose) -> Procedure[None]:
        """Go to a place beside the camera's middle, from the side of all approaches."""
        yield Move(
            _shifted(at, -self.plan.beside_mm),
            Path.STRAIGHT,
            tr("Moving to the next place over the camera."),
        )
        yield from self._approach(at)

    def _approach(self, at: Pose) -> Procedure[None]:
        yield Move(at, Path.STRAIGHT, tr("Approaching the camera from the same side."))

    def _look_beside(self, place: Place) -> Procedure[SeenAt | None]:
        """Take one picture where the approach begins; ``None`` if it shows nothing."""
        beside = self._beside(place)
        pictures = self.plan.pictures if self._measures_pixels else 1
        try:
            look: SeenAt = yield from self._seen(place, beside, pictures)
        except CalibrationError as error:
            if error.code in UNSEEN:
                return None
            yield Move(self._above(beside), Path.STRAIGHT, tr("Lifting off the camera."))
            raise
        return look

    def _seen(
        self, place: Place, at: Pose, pictures: int, *, repeated: bool = False
    ) -> Procedure[Any]:
        """Take pictures with the frame at a pose beside a place; ``None`` for no repeated look."""
        middle, there = self._middle(place), self.pose(place)
        expected_mm = (middle[0] + at.x_mm - there.x_mm, middle[1] + at.y_mm - there.y_mm)
        look: SeenAt | None = yield Look(
            tr("Checking whether the spot moves with the tip."),
            expected_mm,
            place.mark,
            pictures,
            in_pixels=not self.calibrated,
            repeated=repeated,
        )
        return None if look is None else self.watch.heard(look)

    def centred(
        self, places: Sequence[Place], here: Pose, found: Callable[[Sequence[SeenAt]], ToolOffset]
    ) -> Procedure[ToolOffset]:
        """Look where marks are, and return where to expect them from now on.

        Args:
            places: What to look at; ends before the camera, at the last of them.
            here: Where the frame is.
            found: Makes the expectation of the looks.

        Raises:
            CalibrationError: ``far_off``: a mark is farther from where it was expected than
                anything explains; those of :meth:`looks`, and those of ``found``. The frame is
                lifted then.

        Example:
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.procedures import CameraDrive, LookPlan, Place
            >>> from robolink.stations import CameraStation
            >>> from robolink.testing import PaperCell
            >>> here, stored = Pose(300, 100, 20, 0), ToolOffset(12, -4, -20)
            >>> drive = CameraDrive(CameraStation(300, 80, -30), LookPlan(), here)
            >>> def seen_at_zero(looks):
            ...     (look,) = looks
            ...     return ToolOffset(look.spot.x - look.x_mm, look.spot.y - look.y_mm, stored.z_mm)
            >>> cell = PaperCell(here, ToolOffset(12.7, -4.2, -20))
            >>> expected = cell.run(drive.centred([Place(0, stored)], here, seen_at_zero))
            >>> round(expected.x_mm, 3), round(expected.y_mm, 3)
            (12.7, -4.2)
        """
        seen = yield from self.looks(places, here)
        try:
            for place, look in zip(places, seen, strict=True):
                self._require_near(look, self._middle(place))
            return found(seen)
        except CalibrationError:
            yield from self.lifted(places[-1])
            raise

    def _require_near(self, look: SeenAt, middle_mm: tuple[float, float]) -> None:
        away_mm = math.dist(self.station.base_mm(look), middle_mm)
        if away_mm > self.plan.search_mm:
            raise CalibrationError(
                "far_off",
                tr(
                    "The spot is {away:.2f} mm from where it should be, limit {limit:g} mm.",
                    away=away_mm,
                    limit=self.plan.search_mm,
                ),
                remedy=tr(
                    "Look at the picture: is it the tip? Check tool number, offset and mm per "
                    "pixel."
                ),
            )

    def angles_in_reach(
        self, here: Pose, places: Callable[[Sequence[float]], Sequence[Place]]
    ) -> Procedure[tuple[float, ...]]:
        """Return the angles of the plan, or others if the arm cannot reach them.

        They are turned to the other side then, or half as far.

        Args:
            here: Where the frame is; its U is where they count from.
            places: What is looked at with such angles.

        Raises:
            LimitError: It can take up none of them; nothing was moved.
        """
        u_deg = here.u_deg
        planned = self.plan.angles_deg(u_deg)
        return (
            yield from first_clear(
                [tuple(u_deg + (angle - u_deg) * share for angle in planned) for share in _SHARES],
                # Simulated by a separate drive: no camera is used.
                lambda angles: replace(self).looks(places(angles), here),
                here,
            )
        )

    def lifted(self, place: Place) -> Procedure[None]:
        """Lift off the camera from where :meth:`looks` ended."""
        yield Move(self.above(place), Path.STRAIGHT, tr("Lifting off the camera."))

    def above(self, place: Place) -> Pose:
        """Return where :meth:`lifted` ends."""
        return self._above(self.pose(place))

    def pose(self, place: Place) -> Pose:
        """Return where the frame is with a mark before the camera, as far as that is known."""
        frame = replace(self.frame, u_deg=place.u_deg)
        return carrying(frame, place.at, (*self._middle(place), self.station.z_mm))

    def _turn_to(self, place: Place, here: Pose) -> Procedure[None]:
        """Lift, go over and turn, come down beside the place."""
        beside = self._beside(place)
        # If the pixel size is unknown, all movements are compared with the first one, which must
        # therefore be free of play in the joints.
        low = _shifted(beside, -self.plan.beside_mm) if self._measures_pixels else beside
        above = self._above(low)
        high_mm = max(here.z_mm, above.z_mm)
        if here.z_mm < high_mm:
            yield Move(replace(here, z_mm=high_mm), Path.STRAIGHT, tr("Lifting before the turn."))
        yield Move(replace(above, z_mm=high_mm), Path.JOINT, tr("Moving above the camera."))
        yield Move(low, Path.STRAIGHT, tr("Lowering into the camera's focus."))
        if low != beside:
            yield from self._approach(beside)

    @property
    def _measures_pixels(self) -> bool:
        """Return whether the next movement is the first by which a camera is found."""
        return not self.calibrated and not self.watch.pairs

    def _beside(self, place: Place) -> Pose:
        return _shifted(self.pose(place), -self.plan.beside_mm)

    def _look(self, place: Place) -> Procedure[SeenAt]:
        purpose = (
            tr("Looking at the tip.")
            if place.mark == TIP
            else tr("Looking at fiducial {n}.", n=place.mark)
        )
        seen: SeenAt = yield Look(
            purpose,
            self._middle(place),
            place.mark,
            self.plan.pictures,
            in_pixels=not self.calibrated,
            awaited=True,
        )
        told, score = self._told(seen, self._middle(place)), seen.spot.score
        yield Notify(
            told if score is None else tr("{seen}; score {score:g}", seen=told, score=score)
        )
        return self.watch.heard(seen)

    def _told(self, seen: SeenAt, middle_mm: tuple[float, float]) -> str:
        if seen.unit is SpotUnit.PIXEL and self.station.model is None:
            return tr("seen at pixel {x:.1f}, {y:.1f}", x=seen.spot.x, y=seen.spot.y)
        x_mm, y_mm = self.station.base_mm(seen)
        return tr(
            "seen X {dx:+.3f} Y {dy:+.3f} mm from where it is expected",
            dx=x_mm - middle_mm[0],
            dy=y_mm - middle_mm[1],
        )

    def _middle(self, place: Place) -> tuple[float, float]:
        return self.station.x_mm + place.aside_mm[0], self.station.y_mm + place.aside_mm[1]

    def _above(self, pose: Pose) -> Pose:
        return replace(pose, z_mm=pose.z_mm + self.plan.lift_mm)


def _in_doubt() -> str:
    return tr("The spot did not move with the robot. Checking again, more closely.")


def _shifted(pose: Pose, by_mm: float) -> Pose:
    """Return a pose as far aside in X as in Y."""
    return replace(pose, x_mm=pose.x_mm + by_mm, y_mm=pose.y_mm + by_mm)
