"""The imperfections of a simulated cell, and the build of its camera, as named numbers.

The same for every kind of robot. They are given to a simulator when it is made (``--world``, or
``world.NAME`` in a sim URL), or later through the assist act ``set_world``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink_simulators.cell.camera import CameraOptics, FinderFaults
from robolink_simulators.cell.habits import BiasFrame, PersonHabits, PinBump
from robolink_simulators.cell.picture_settings import (
    FleckShape,
    MarkShape,
    PictureFaults,
    PictureLook,
    Stuck,
)
from robolink_simulators.cell.surfaces import Touched
from robolink_simulators.cell.tip_looks import TipBuild, TipKind
from robolink_simulators.cell.tip_switches import Lean
from robolink_simulators.option_values import values_from_text

LIMITS: Final[Mapping[str, tuple[float, float]]] = {
    "tip_diameter_mm": (0.01, 100),
    "tip_dirt": (0, 20),
    "picture_clutter": (0, 50),
}
"""Lowest and highest value of parameters that cannot be drawn otherwise."""

PREFIX: Final = "world."
"""Prefix of the world parameters in a sim URL."""


@dataclass(frozen=True, slots=True)
class WorldParameters:
    """One cell's imperfections.

    Attributes:
        eye_sigma_mm: Standard deviation of what a person's eye reads, per axis.
        eye_outlier_share: Share of the readings that are wrong by ``eye_outlier_mm``.
        eye_outlier_mm: By how much those are wrong, sideways.
        backlash_deg: Play of the rotary axes behind the encoder.
        backlash_mm: Play of the linear axes.
        lean_deg: By how much the mounted nozzle's shaft is bent.
        lean_toward_deg: Toward which direction, counted from the flange's X.
        lean_up_to_mm: Height above the tip up to which the shaft leans; above that it stands
            upright, as where somebody bent it sideways there. 0: it leans all the way.
        beams_moved_mm, beams_moved_toward_deg: How far, and in which direction of the base, every
            light beam has been moved from where it was mounted.
        wobble_mm: How far the mounted nozzle's tip circles twice a turn (a second harmonic), as
            on a spindle with a bad bearing. What it meets, a pin or a beam, does not feel it.
        wobble_toward_deg: In which direction of the base it is off with U at 0.
        tool_u_deg, tool_v_deg, tool_w_deg: How the mounted tool is turned on the flange.
        camera_um_per_px_x, camera_um_per_px_y: Length of a pixel at focus.
        camera_turn_deg, camera_shear_deg, camera_mirrored: How the image lies in the base.
        camera_tilt_deg, camera_tilt_toward_deg: By how much, and where to, the lens leans.
        camera_noise_px: Standard deviation of a found place, per axis.
        camera_outlier_share, camera_outlier_px: Share and size of false finds.
        camera_miss_share: Share of the pictures in which nothing is found.
        camera_still_share, camera_still_from_picture, camera_still_unseen: Share of the pictures
            in which the finder answers with a spot that stands still, the first picture to which
            it applies, and whether only where no mark is in the picture.
        camera_still_beside_px, camera_still_toward_deg: How far from the middle of the image it
            stands, and in which direction, from right to down.
        camera_spot_radius_px: Radius of a found spot that the finder tells; 0 for none.
        camera_spot_swells_by, camera_spot_swells_from_picture: Share by which that grows, and
            from which picture on. Pictures count from when the world was set up.
        camera_tip_beside_px, camera_tip_beside_toward_deg: How far beside where it is the camera
            sees a tip, and in which direction, counted from the flange's X: a rough edge, a bevel.
            It turns with the tool.
        camera_moved_mm, camera_moved_toward_deg: How far, and in which direction of the base, the
            camera has been moved from where it was mounted.
        tip_kind, tip_diameter_mm, tip_bore_mm, tip_bore_aside_mm, tip_dirt, tip_dark: How tips
            look in drawn pictures: what is at the end, how wide face and bore are, how far the
            bore is off its middle, how many specks are on it, whether it is black.
        second_tip_beside_mm, second_tip_toward_deg: How far beside the mounted nozzle there is
            another one, and in which direction, counted from the flange's X; 0 for none.
        picture_blur_px, picture_aperture_mm, picture_noise_grey, picture_clutter, picture_glare:
            What all drawn pictures are like; see :class:`PictureLook`.
        picture_exposure, picture_defocus_mm, picture_stuck, picture_late, picture_late_s,
            picture_fleck, picture_fleck_radius_px, picture_fleck_beside_px,
            picture_fleck_toward_deg, picture_tip_hidden, picture_halved, picture_gone,
            picture_slow_s: What is wrong with some; see :class:`PictureFaults`.
        picture_faults_from, picture_faults_count: From which picture on, counted from when the
            world was set up, and with how many; 0 for all that follow.
        board_held: Whether the nozzle holds a board, which hides its tip.
        board_mark, board_mark_mm: What its fiducials look like in drawn pictures, and how wide
            they are.
        person_stays_share, person_stays_from_touch: Share of the touches for which the person
            only presses ENTER, and the first one to which it applies.
        person_bias_mm, person_bias_frame, person_bias_toward_deg: How far, and toward what, the
            person always stops beside the pin.
        person_tires_mm: Step from touch to touch, per axis, by which the person's aim wanders.
        person_angle_error_deg: By how much the person turns U before a touch, to either side.
        person_presses_mm: How much deeper than the contact the person goes.
        person_types_ahead: Whether ENTER is pressed before each touch is asked for.
        person_thinks_s: How long the person looks before the first answer to a question.
        person_touches: What the person brings the tip onto: the pin, or a plane or a sphere in its
            place, wherever the tip is near it.
        plane_lean_deg, plane_lean_toward_deg: By how much the plane leans from the level, and in
            which direction of the base it falls. The pin's top is a point of it.
        sphere_radius_mm: Radius of the sphere. The pin's top is its highest point.
        contact_input: Number of the input that is on while the mounted nozzle touches what the
            person brings it onto; none where they are not wired.
        pin_radius_mm: Half the thickness of the pin, for that.
        pin_bumped_after_touch, pin_bump_mm, pin_bump_toward_deg: After which touch the pin is
            bumped, how far, and in which direction of the base.
    """

    eye_sigma_mm: float = 0.01
    eye_outlier_share: float = 0.0
    eye_outlier_mm: float = 0.5
    backlash_deg: float = 0.0
    backlash_mm: float = 0.0
    lean_deg: float = 0.0
    lean_toward_deg: float = 0.0
    lean_up_to_mm: float = 0.0
    beams_moved_mm: float = 0.0
    beams_moved_toward_deg: float = 0.0
    wobble_mm: float = 0.0
    wobble_toward_deg: float = 0.0
    tool_u_deg: float = 0.0
    tool_v_deg: float = 0.0
    tool_w_deg: float = 0.0
    camera_um_per_px_x: float = 20.0
    camera_um_per_px_y: float = 20.0
    camera_turn_deg: float = 3.0
    camera_shear_deg: float = 0.0
    camera_mirrored: bool = True
    camera_tilt_deg: float = 0.0
    camera_tilt_toward_deg: float = 0.0
    camera_noise_px: float = 0.1
    camera_outlier_share: float = 0.0
    camera_outlier_px: float = 40.0
    camera_miss_share: float = 0.0
    camera_still_share: float = 0.0
    camera_still_from_picture: int = 1
    camera_still_unseen: bool = False
    camera_still_beside_px: float = 0.0
    camera_still_toward_deg: float = 0.0
    camera_spot_radius_px: float = 0.0
    camera_spot_swells_by: float = 0.0
    camera_spot_swells_from_picture: int = 1
    camera_tip_beside_px: float = 0.0
    camera_tip_beside_toward_deg: float = 0.0
    camera_moved_mm: float = 0.0
    camera_moved_toward_deg: float = 0.0
    tip_kind: TipKind = "clean"
    tip_diameter_mm: float = 1.0
    tip_bore_mm: float = 0.5
    tip_bore_aside_mm: float = 0.0
    tip_dirt: int = 0
    tip_dark: bool = False
    second_tip_beside_mm: float = 0.0
    second_tip_toward_deg: float = 0.0
    picture_blur_px: float = 0.7
    picture_aperture_mm: float = 20.0
    picture_noise_grey: float = 2.0
    picture_clutter: int = 3
    picture_glare: float = 0.2
    picture_exposure: float = 1.0
    picture_defocus_mm: float = 0.0
    picture_stuck: Stuck = "no"
    picture_late: int = 0
    picture_late_s: float = 0.0
    picture_fleck: FleckShape = "none"
    picture_fleck_radius_px: float = 25.0
    picture_fleck_beside_px: float = 0.0
    picture_fleck_toward_deg: float = 0.0
    picture_tip_hidden: bool = False
    picture_halved: bool = False
    picture_gone: bool = False
    picture_slow_s: float = 0.0
    picture_faults_from: int = 1
    picture_faults_count: int = 0
    board_held: bool = False
    board_mark: MarkShape = "round"
    board_mark_mm: float = 1.0
    person_stays_share: float = 0.0
    person_stays_from_touch: int = 1
    person_bias_mm: float = 0.0
    person_bias_frame: BiasFrame = "base"
    person_bias_toward_deg: float = 0.0
    person_tires_mm: float = 0.0
    person_angle_error_deg: float = 0.0
    person_presses_mm: float = 0.0
    person_types_ahead: bool = False
    person_thinks_s: float = 1.0
    person_touches: Touched = "pin"
    plane_lean_deg: float = 0.0
    plane_lean_toward_deg: float = 0.0
    sphere_radius_mm: float = 10.0
    contact_input: int | None = None
    pin_radius_mm: float = 0.25
    pin_bumped_after_touch: int = 2
    pin_bump_mm: float = 0.0
    pin_bump_toward_deg: float = 0.0

    @property
    def lean(self) -> Lean:
        """The bent shaft, in the flange's axes."""
        beside, toward = math.tan(math.radians(self.lean_deg)), math.radians(self.lean_toward_deg)
        return beside * math.cos(toward), beside * math.sin(toward)

    @property
    def beams_moved(self) -> tuple[float, float]:
        """How far the light beams have been moved, X and Y of the base, mm."""
        toward = math.radians(self.beams_moved_toward_deg)
        return self.beams_moved_mm * math.cos(toward), self.beams_moved_mm * math.sin(toward)

    @property
    def tool_turn(self) -> tuple[float, float, float]:
        """U, V and W of the mounted tool."""
        return self.tool_u_deg, self.tool_v_deg, self.tool_w_deg

    @property
    def camera_moved(self) -> tuple[float, float]:
        """How far the camera has been moved, X and Y of the base, mm."""
        toward = math.radians(self.camera_moved_toward_deg)
        return self.camera_moved_mm * math.cos(toward), self.camera_moved_mm * math.sin(toward)

    @property
    def second_tip_mm(self) -> tuple[float, float] | None:
        """Where another nozzle is beside the mounted one, X and Y of the flange; ``None``: none."""
        if not self.second_tip_beside_mm:
            return None
        toward, beside_mm = math.radians(self.second_tip_toward_deg), self.second_tip_beside_mm
        return beside_mm * math.cos(toward), beside_mm * math.sin(toward)

    @property
    def tip_build(self) -> TipBuild:
        """How tips look."""
        return TipBuild(**{it.name: getattr(self, f"tip_{it.name}") for it in fields(TipBuild)})

    @property
    def picture_look(self) -> PictureLook:
        """What all drawn pictures are like."""
        names = [field.name for field in fields(PictureLook)]
        return PictureLook(**{name: getattr(self, f"picture_{name}") for name in names})

    @property
    def picture_faults(self) -> PictureFaults:
        """What is wrong with some of the drawn pictures."""
        names = [
            it.name for it in fields(PictureFaults) if it.name not in ("from_picture", "count")
        ]
        return PictureFaults(
            from_picture=self.picture_faults_from,
            count=self.picture_faults_count,
            **{name: getattr(self, f"picture_{name}") for name in names},
        )

    @property
    def optics(self) -> CameraOptics:
        """The camera."""
        names = [field.name for field in fields(CameraOptics) if field.name != "size_px"]
        return CameraOptics(**{name: getattr(self, f"camera_{name}") for name in names})

    @property
    def tip_seen_beside_mm(self) -> tuple[float, float]:
        """How far from its place the camera sees a tip, X and Y of the flange."""
        toward = math.radians(self.camera_tip_beside_toward_deg)
        beside_mm = self.camera_tip_beside_px * self.camera_um_per_px_x / 1000
        return beside_mm * math.cos(toward), beside_mm * math.sin(toward)

    @property
    def finder_faults(self) -> FinderFaults:
        """The faults of the camera's finder."""
        names = [field.name for field in fields(FinderFaults)]
        return FinderFaults(**{name: getattr(self, f"camera_{name}") for name in names})

    @property
    def habits(self) -> PersonHabits:
        """The person."""
        names = [field.name for field in fields(PersonHabits)]
        return PersonHabits(**{name: getattr(self, f"person_{name}") for name in names})

    @property
    def contact(self) -> tuple[int | None, float, Touched]:
        """How nozzle and pin are wired: the input, the pin's radius in mm, the touched object."""
        return self.contact_input, self.pin_radius_mm, self.person_touches

    @property
    def bump(self) -> PinBump:
        """What happens to the pin."""
        return PinBump(self.pin_bumped_after_touch, self.pin_bump_mm, self.pin_bump_toward_deg)


def parameter_names() -> tuple[str, ...]:
    """Return the name of every parameter."""
    return tuple(field.name for field in fields(WorldParameters))


def parameters_from_text(pairs: Mapping[str, str]) -> dict[str, object]:
    """Return the values of parameters that were given as text, by name.

    Raises:
        ConfigError: A parameter is unknown, or a value does not fit it.
    """
    for name in pairs:
        if name not in parameter_names():
            raise ConfigError(
                tr("The simulated world has no parameter {name!r}.", name=name),
                remedy=known_names(parameter_names(), name),
            )
    values = values_from_text(WorldParameters, pairs)
    for name in ("camera_um_per_px_x", "camera_um_per_px_y"):
        if values.get(name, 1.0) == 0:
            raise ConfigError(
                tr("A pixel cannot be 0 long."), remedy=tr("Give {name} above 0.", name=name)
            )
    for name in ("person_stays_share", "camera_still_share"):
        if values.get(name, 0.0) > 1:
            raise ConfigError(
                tr("A share cannot be above 1."), remedy=tr("Give {name} from 0 to 1.", name=name)
            )
    for name, (least, most) in LIMITS.items():
        if name in pairs and not least <= values[name] <= most:
            allowed = tr("a number from {least:g} to {most:g}", least=least, most=most)
            raise ConfigError(
                tr("The option {name} cannot be {value!r}.", name=name, value=pairs[name]),
                remedy=tr("It takes: {allowed}.", allowed=allowed),
            )
    return values


def from_options(options: Mapping[str, str]) -> WorldParameters:
    """Return the world that the options ``world.NAME`` of a sim URL describe.

    Raises:
        ConfigError: As :func:`parameters_from_text`.
    """
    own = {
        name.removeprefix(PREFIX): value
        for name, value in options.items()
        if name.startswith(PREFIX)
    }
    return WorldParameters(**parameters_from_text(own))  # type: ignore[arg-type]


def plain(options: Mapping[str, str]) -> dict[str, str]:
    """Return the options of a sim URL that are not about the world."""
    return {name: value for name, value in options.items() if not name.startswith(PREFIX)}
