"""The parameters that methods share: of a tip on a pin, and of a camera that looks up."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from annotated_types import Ge, Le, MaxLen, MinLen

from robolink.calibration import HIGHEST_MM, MIN_ROTATION_DEG, CameraModel, angle_spread_deg
from robolink.errors import ConfigError
from robolink.files.toml import Problem
from robolink.messages import declared, tr
from robolink.methods.method import (
    DEGREES,
    MM,
    Angle,
    Check,
    Help,
    InputNumber,
    LengthRule,
    MethodParameters,
    Option,
    Pair,
    Rows,
)
from robolink.model import InputEdge
from robolink.procedures import HALF_ROUND_DEG, LEAST_BESIDE_MM, LookPlan, SamplingPolicy, TouchPlan
from robolink.remedy_words import RemedyWord, remedy_word

if TYPE_CHECKING:
    from robolink.methods.method import Site
    from robolink.model import TipSensor
    from robolink.stations import CameraStation


Retake = Annotated[
    bool,
    Option(flag="--retake/--no-retake", default=True),
    Help(declared("Offer to repeat the touch that fits worst.")),
]
"""Whether the worst touch is offered again after all touches."""


@dataclass(frozen=True, kw_only=True)
class PinParameters(MethodParameters):
    """How a tip is lifted off a pin and returned."""

    lift_mm: Annotated[
        float, Ge(1), Le(100), MM, Help(declared("How far to lift the tip before the turn."))
    ] = 10.0
    clearance_mm: Annotated[
        float,
        Ge(0.5),
        Le(50),
        MM,
        Help(
            declared(
                "Least distance above the pin at which the robot stops; a person jogs the rest."
            )
        ),
    ] = 2.0
    contact_input: Annotated[
        InputNumber | None,
        Option(metavar="N"),
        Help(declared("Number of the input that shows contact of tip and pin, if there is one.")),
    ] = None
    off_in_contact: Annotated[
        bool,
        Help(declared("The input goes off, not on, in contact.")),
    ] = False

    @property
    def touch(self) -> TouchPlan:
        """The same for a procedure."""
        contact = None
        if self.contact_input is not None:
            contact = InputEdge(self.contact_input, falling=self.off_in_contact)
        return TouchPlan(lift_mm=self.lift_mm, clearance_mm=self.clearance_mm, contact=contact)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that the tip stops on its way down to the pin."""
        yield from standoff_below_lift(self.clearance_mm, self.lift_mm, check)
        if self.off_in_contact and self.contact_input is None:
            yield Problem(
                "off_in_contact", tr("goes with {other}", other=check.spell("contact_input"))
            )

    def room_mm(self) -> float:
        """Return how high the box has to be."""
        return self.lift_mm


@dataclass(frozen=True, kw_only=True)
class UprightPinParameters(PinParameters):
    """How an upright tip that keeps its Z touches a pin: heights show whether it may."""

    if_length_changed: Annotated[
        LengthRule,
        Option(moves=False),
        Help(
            declared(
                "What happens when the heights of the touches show a longer or shorter tip: ask "
                "a person, write Z by the difference, or keep Z. If nobody can be asked, ask "
                "writes nothing."
            )
        ),
    ] = "ask"

    def length_rule(self) -> LengthRule:
        """Return what to do if the length changed."""
        return self.if_length_changed


class SampledParameters(MethodParameters, ABC):
    """How often an input is switched, until that is enough.

    What derives from it has the fields ``until_mm`` and ``retake``, each with a help of its own.
    """

    until_mm: float | None
    retake: bool

    @property
    def sampling(self) -> SamplingPolicy:
        """When it ends, and whether a person is offered to repeat a sample."""
        return SamplingPolicy(self.until_mm, retake=self.retake)

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that an early end and a retake can have an effect."""
        if "retake" in check.given and self.retake and self.no_residual():
            yield Problem(
                "retake", tr("has no effect: nothing is repeated, so nothing can fit badly")
            )
        if self.until_mm is None or check.sigma_stated is None:
            return
        if not self.may_end_early(sigma_stated=check.sigma_stated):
            yield Problem("until_mm", self.nothing_to_leave_out(check))

    @abstractmethod
    def may_end_early(self, *, sigma_stated: bool) -> bool:
        """Return whether the tip can be known well enough before the last sample."""

    @abstractmethod
    def nothing_to_leave_out(self, check: Check) -> str:
        """Return why it cannot end early, and which values to give."""


def clearance_below_lift(clearance_mm: float, lift_mm: float, check: Check) -> Iterator[Problem]:
    """Check that a distance is left to come down."""
    if clearance_mm >= lift_mm:
        yield Problem(
            "clearance_mm",
            tr(
                "must be smaller than {other}, which is {lift:g}",
                other=check.spell("lift_mm"),
                lift=lift_mm,
            ),
        )


def standoff_below_lift(clearance_mm: float, lift_mm: float, check: Check) -> Iterator[Problem]:
    """Check that a distance is left between the lift and the highest standoff."""
    if clearance_mm + HIGHEST_MM >= lift_mm:
        yield Problem(
            "clearance_mm",
            tr(
                "must be more than {highest:g} below {other}, which is {lift:g}: the robot stops "
                "up to {highest:g} mm above the clearance",
                highest=HIGHEST_MM,
                other=check.spell("lift_mm"),
                lift=lift_mm,
            ),
        )


def two_poses_agree() -> str:
    """Return why the residuals of two poses cannot be judged."""
    return tr(
        "cannot be judged: two poses cannot check each other; use n-angle, or limit "
        "the interval and state the standard deviation"
    )


Turns = Annotated[
    tuple[Angle, ...],
    MinLen(1),
    MaxLen(24),
    DEGREES,
    Option(flag="--angles", metavar="0,60,.."),
    Help(declared("U of each look, relative to the present U, counted toward zero.")),
]

PLACE = (
    declared("where the camera looks"),
    declared("the height in focus"),
)
"""Descriptions of the station's X and Y, and of its Z."""

UNMEASURED_Z = declared('cannot be "measured" by a camera; write "typed" or "kept"')


@dataclass(frozen=True, kw_only=True)
class LookParameters(MethodParameters):
    """How marks are moved before a camera and looked at."""

    plan_kind: ClassVar[type[LookPlan]] = LookPlan

    sensor: Annotated[
        str | None,
        MinLen(1),
        Option(metavar="NAME|URL", moves=False),
        Help(declared("The camera: a plug-in's name or URL, or a simulator's assist or sim URL.")),
    ] = None
    mm_per_px: Annotated[
        Rows | None,
        MM,
        Option(flag="--mm-per-px", metavar="XX,XY,YX,YY", moves=False),
        Help(
            declared(
                "What a pixel is in the base: X along the image's first and second axis, then Y; "
                "as camera-affine found it. Not for a camera that answers in mm."
            )
        ),
    ] = None
    origin_mm: Annotated[
        Pair | None,
        MM,
        Option(metavar="X,Y", moves=False),
        Help(declared("Base point that is seen at pixel (0, 0); goes with what a pixel is.")),
    ] = None
    turns_deg: Turns = HALF_ROUND_DEG
    pictures: Annotated[
        int,
        Ge(1),
        Le(25),
        Help(declared("How many pictures are taken at each look; the median counts.")),
    ] = 3
    lift_mm: Annotated[
        float, Ge(1), Le(100), MM, Help(declared("How far to lift the tip before the turn."))
    ] = 10.0
    beside_mm: Annotated[
        float,
        Ge(LEAST_BESIDE_MM),
        Le(10),
        MM,
        Help(
            declared(
                "How far beside each place its approach begins, always on the same side; a "
                "picture there shows whether the spot moves with the tip."
            )
        ),
    ] = 1.0
    retake: Annotated[
        bool,
        Option(flag="--retake/--no-retake", default=True),
        Help(declared("Offer to repeat the look that fits worst.")),
    ] = False

    @property
    def look(self) -> LookPlan:
        """The same for a procedure."""
        return self.plan_kind(
            turns_deg=self.turns_deg,
            pictures=self.pictures,
            lift_mm=self.lift_mm,
            beside_mm=self.beside_mm,
        )

    @property
    def model(self) -> CameraModel | None:
        """What its pixels mean, ``None`` if that is not stated."""
        if self.mm_per_px is None or self.origin_mm is None:
            return None
        return CameraModel(self.mm_per_px, self.origin_mm)

    @property
    def corners_deg(self) -> tuple[float, ...]:
        """Angles of looks besides those of ``turns_deg``."""
        return ()

    def problems(self, check: Check) -> Iterator[Problem]:
        """Check that pixels are fully explained, and that the tool turns."""
        yield from self._of_pixels(check)
        angles_deg = (*self.corners_deg, *self.turns_deg)
        if len(angles_deg) > 1 and angle_spread_deg(angles_deg) < MIN_ROTATION_DEG:
            yield Problem(
                "turns_deg",
                tr("must spread over at least {limit:g} degrees", limit=MIN_ROTATION_DEG),
            )

    def room_mm(self) -> float:
        """Return how high the box has to be."""
        return self.lift_mm

    def _of_pixels(self, check: Check) -> Iterator[Problem]:
        if (self.mm_per_px is None) != (self.origin_mm is None):
            absent = "origin_mm" if self.origin_mm is None else "mm_per_px"
            yield Problem(
                absent,
                tr(
                    "is missing: give {scale} and {origin}, or neither",
                    scale=check.spell("mm_per_px"),
                    origin=check.spell("origin_mm"),
                ),
            )
        elif self.model is not None and not self.model.determinant:
            yield Problem("mm_per_px", tr("maps all pixels onto one line"))


def camera_at(parameters: LookParameters, site: "Site") -> "tuple[str | TipSensor, CameraStation]":
    """Return the camera, its name or URL, and where it looks.

    Raises:
        ConfigError: Nobody knows one of them.
    """
    from robolink.stations import camera_station, sensor_of  # not needed for --help

    sensor = site.sensor or parameters.sensor or sensor_of(site.station)
    if not sensor:
        raise ConfigError(
            tr("It is not known which camera looks at station {id}.", id=site.station.id),
            remedy=tr(
                "Give {sensor}, write source.sensor, or state it in the cell file.",
                sensor=remedy_word(RemedyWord.SENSOR),
            ),
        )
    stated = parameters.model is not None
    station = site.stating(
        mm_per_px=parameters.mm_per_px if stated else None,
        origin_mm=parameters.origin_mm if stated else None,
    )
    return sensor, camera_station(station)
