"""The keys of one ``[cells.NAME]`` table. Imported when a file is loaded, for pydantic."""

from datetime import date
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from robolink.controllers import capabilities_of_kind
from robolink.errors import ConfigError
from robolink.journal import plant_place
from robolink.locale.languages import language_named
from robolink.messages import tr
from robolink.model import ACCELERATION_RANGE_MM_S2, PersonRole
from robolink.transport import parse_url
from robolink.transport.opcua.security import fingerprint_digits

ShortText = Annotated[str, Field(min_length=1, max_length=200)]
Positive = Annotated[float, Field(gt=0)]
InputNumber = Annotated[int, Field(ge=0, le=0xFFFF)]
Angle = Annotated[float, Field(ge=-360, le=360)]

STRICT = ConfigDict(
    extra="forbid", frozen=True, strict=True, allow_inf_nan=False, hide_input_in_errors=True
)


class _Station(BaseModel):
    """The keys that all kinds of stations share.

    Attributes:
        x_mm, y_mm, z_mm: Where it is, base; once it is learnt, the journal knows better.
        sigma_mm: Standard deviation of each of them.
        gauge: Id of the gauge or pin that stands there, as on its certificate.
        gauge_due: Until when its calibration holds, as its certificate says.
        check_every_days: After so many days it has to be learnt again.
        notes: For people.
    """

    model_config = STRICT

    x_mm: float | None = None
    y_mm: float | None = None
    z_mm: float | None = None
    sigma_mm: Positive | None = None
    gauge: ShortText | None = None
    gauge_due: date | None = None
    check_every_days: Positive | None = None
    notes: str | None = None


class PinSettings(_Station):
    """A pin that a person touches with a tip.

    Attributes:
        place_mm, touch_mm: What is stated of these rows for this pin, half widths.
    """

    kind: Literal["pin"]
    place_mm: Positive | None = None
    touch_mm: Positive | None = None


class BeamLineSettings(BaseModel):
    """One light beam.

    Attributes:
        input: Number of the input that it switches.
        x_mm, y_mm: A point of it, base.
        direction_deg: Its direction in the base, counter-clockwise from X.
    """

    model_config = STRICT

    input: InputNumber
    x_mm: float
    y_mm: float
    direction_deg: Angle


class BeamsSettings(_Station):
    """Two crossed light beams; ``z_mm`` is their height.

    Attributes:
        beams: The two beams, as they are to within a millimetre or two.
        off_when_broken: Whether an input goes off, not on, while its beam is broken.
        place_mm, bend_deg: What is stated of these rows for these beams, half widths.
    """

    kind: Literal["beams"]
    z_mm: float
    beams: Annotated[tuple[BeamLineSettings, ...], Field(strict=False, min_length=2, max_length=2)]
    off_when_broken: bool = False
    place_mm: Positive | None = None
    bend_deg: Positive | None = None


class TouchSettings(_Station):
    """A level surface that switches an input when a tip touches it.

    Attributes:
        input: The input that it switches.
        off_when_touched: Whether that goes off, not on, at a touch.
        plate_mm: What is stated of the row of its height, half width.
    """

    kind: Literal["touch"]
    x_mm: float
    y_mm: float
    z_mm: float
    input: InputNumber
    off_when_touched: bool = False
    plate_mm: Positive | None = None


Pair = Annotated[tuple[float, ...], Field(strict=False, min_length=2, max_length=2)]


class CameraSettings(_Station):
    """An up-looking camera; X, Y and Z are where it sees tips in focus.

    Attributes:
        sensor: Name or URL of the camera.
        mm_per_px: What a pixel is in the base, where that is known without robolink: two rows.
        origin_mm: Base point that is seen at pixel (0, 0), likewise.
        diameter_mm: Diameter of the face of the tips that come before it, for robolink's own
            finder.
        bore: Whether those tips have a hole in the middle; a missing one is for yes.
        polarity: How their face differs from what is around it.
        marks: What the fiducials of a held board look like.
        mark_mm: Diameter of a round fiducial, else its width.
        exposure_us: Exposure time in microseconds, where the camera can be told it.
        place_mm, camera_turn_deg, camera_scale_percent, tip_image_px, print_mm: What is stated of
            these rows for this camera, half widths.
    """

    kind: Literal["camera"]
    x_mm: float
    y_mm: float
    z_mm: float
    sensor: ShortText | None = None
    mm_per_px: (
        Annotated[tuple[Pair, ...], Field(strict=False, min_length=2, max_length=2)] | None
    ) = None
    origin_mm: Annotated[Pair | None, Field(validate_default=True)] = None
    diameter_mm: Annotated[float, Field(gt=0, le=100)] | None = None
    bore: bool | None = None
    polarity: Literal["bright", "dark", "either"] | None = None
    marks: Literal["round", "cross", "aruco", "aruco-5x5", "aruco-6x6", "aruco-7x7"] | None = None
    mark_mm: Annotated[float, Field(gt=0, le=100)] | None = None
    exposure_us: Annotated[float, Field(gt=0, le=10_000_000)] | None = None
    place_mm: Positive | None = None
    camera_turn_deg: Positive | None = None
    camera_scale_percent: Positive | None = None
    tip_image_px: Positive | None = None
    print_mm: Positive | None = None

    @field_validator("origin_mm")
    @classmethod
    def _goes_with_the_pixels(
        cls, origin_mm: tuple[float, ...] | None, info: ValidationInfo
    ) -> tuple[float, ...] | None:
        # An invalid value is missing from the data and already reported.
        pixels = info.data.get("mm_per_px", ...)
        if pixels is not ... and (pixels is None) != (origin_mm is None):
            raise ValueError(tr("needs mm_per_px: give both, or neither"))
        return origin_mm


StationSettings = Annotated[
    PinSettings | BeamsSettings | TouchSettings | CameraSettings, Field(discriminator="kind")
]
"""Settings of a station; further kinds of stations join this union."""


def station_keys() -> dict[str, list[str]]:
    """Return the keys of each kind of station."""
    return {
        "pin": list(PinSettings.model_fields),
        "beams": list(BeamsSettings.model_fields),
        "touch": list(TouchSettings.model_fields),
        "camera": list(CameraSettings.model_fields),
    }


class AccuracySettings(BaseModel):
    """Half widths of rows that a cell file states; one that is missing is unknown.

    The keys are those of ``robolink.calibration.ACCURACY_ROWS``; what is stated for a station
    goes before.

    Attributes:
        touch_mm: How a person sees contact.
        place_mm: Place of a station since it was learnt.
        camera_turn_deg, camera_scale_percent: Turn and scale of a camera since it was calibrated.
        plate_mm: Height of a surface.
        tip_image_px: What a camera sees of a tip.
        bend_deg: Bend of a needle that is left after its correction.
        print_mm: Print of the fiducials.
    """

    model_config = STRICT

    touch_mm: Positive | None = None
    place_mm: Positive | None = None
    camera_turn_deg: Positive | None = None
    camera_scale_percent: Positive | None = None
    plate_mm: Positive | None = None
    tip_image_px: Positive | None = None
    bend_deg: Positive | None = None
    print_mm: Positive | None = None


Text = Annotated[str, Field(min_length=1)]


def _is_a_journal(text: str) -> str:
    scheme, mark, rest = text.partition("://")
    if mark and scheme not in ("sqlite", "postgresql", "postgresql+psycopg"):
        raise ValueError(tr("must be a path, or postgresql://user@host/database"))
    before, at, _ = rest.partition("@")
    if (at and ":" in before) or "password=" in rest.lower():
        raise ValueError(
            tr("must not contain a password; put it into ~/.pgpass, or into PGPASSWORD")
        )
    return text


def _is_a_fingerprint(text: str) -> str:
    if fingerprint_digits(text) is None:
        raise ValueError(tr("must be a SHA-256 fingerprint of 64 hexadecimal digits"))
    return text


JournalPlace = Annotated[Text, AfterValidator(_is_a_journal)]

ComputerName = Annotated[str, Field(pattern=r"^[^\s/\\:@,;]{1,253}$")]
"""As its system tells it; no address and no URL, which no computer is called."""

EachJoint = Annotated[tuple[Positive, ...], Field(strict=False, min_length=2, max_length=6)]

_LEAST_MM_S2, _HIGHEST_MM_S2 = ACCELERATION_RANGE_MM_S2


class CellSettings(BaseModel):
    """One cell: how to reach it, and its limits. A missing key is ``None``.

    The limits are those of the options of the same name; an option on the command line wins.

    Attributes:
        url: The controller's URL.
        robot: Model of the robot that must be found there.
        tool: Number of the tool that is selected whenever nothing is being measured.
        password_file: File whose first line is the password, seen from the cell file.
        password_env: Environment variable that holds the password.
        server_certificate: SHA-256 of the certificate of an OPC UA server, as a person compared it.
        user: Who logs in to an OPC UA server.
        journal: Where the journal of this cell is: a path, seen from the cell file, or a URL.
        home: Name of the computer where the journal lies, and where alone the cell is changed.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out set in the controller, which cannot be read over
            the wire (docs/reference/epson.md 1.1).
        remote_timeout_confirmed_by: Who looked at the controller's setting, and when.
        speed_mm_s: Speed of moves, in low power.
        acceleration_mm_s2: Highest acceleration of straight movements; it is only ever lowered
            to this.
        joint_speeds, joint_accelerations: Highest speed and acceleration of each joint at 100 %,
            degrees and mm, where nobody else tells them: robolink only calculates with them how
            long the robot will take.
        box_mm: How far, sideways, the flange may go in a calibration.
        jog_box_mm: How far the tool may be jogged, in every direction.
        lift_mm, clearance_mm: How far the tip is lifted before it turns, and how far above
            the pin it stops.
        max_change_mm: Largest plausible change against the stored offset.
        max_change_deg: Largest change of a tool's orientation that is typed without an engineer.
        drift_tolerance_mm: Largest drift about the new tip that passes.
        rms_tolerance_mm, residual_tolerance_mm: Largest rms of the residuals of a calibration,
            and largest single one, that is believed.
        interval_tolerance_mm: Largest distance from the truth within which a tip lies in 95 %.
        accuracy: What is stated of the rows of a budget for the whole cell.
        watch_s: How often a panel looks at the cell while no job runs; a missing one is for only
            when its page is opened.
        enable_input: Number of the input, a key switch, that is on whenever the robot may move; it
            is read before each movement.
        stop_on_silence_s: How long a page that shows a job may be silent during a movement until
            the robot is stopped; a missing one lets the movement end by itself.
        people: Who works at the cell: badge or name, and ``operator`` or ``engineer``.
        stations: Pins, beams, surfaces and cameras that stand there, by name.
        notes: For people.
    """

    model_config = STRICT

    url: Text | None = None
    robot: Text | None = None
    tool: Annotated[int, Field(ge=0, le=15)] | None = None
    password_file: Text | None = None
    password_env: Annotated[str, Field(pattern="^ROBOLINK_PASSWORD[A-Z0-9_]*$")] | None = None
    server_certificate: Annotated[str, AfterValidator(_is_a_fingerprint)] | None = None
    user: ShortText | None = None
    journal: JournalPlace | None = None
    home: ComputerName | None = None
    timeout_s: Positive | None = None
    remote_timeout_s: Positive | None = None
    remote_timeout_confirmed_by: Annotated[Text | None, Field(validate_default=True)] = None
    speed_mm_s: Annotated[float, Field(ge=1, le=100)] | None = None
    acceleration_mm_s2: Annotated[int, Field(ge=_LEAST_MM_S2, le=_HIGHEST_MM_S2)] | None = None
    joint_speeds: EachJoint | None = None
    joint_accelerations: Annotated[EachJoint | None, Field(validate_default=True)] = None
    box_mm: Annotated[float, Field(ge=1)] | None = None
    jog_box_mm: Positive | None = None
    lift_mm: Annotated[float, Field(ge=1, le=100)] | None = None
    clearance_mm: Annotated[float, Field(ge=0.5, le=50)] | None = None
    max_change_mm: Positive | None = None
    max_change_deg: Annotated[float, Field(gt=0, le=180)] | None = None
    drift_tolerance_mm: Positive | None = None
    rms_tolerance_mm: Positive | None = None
    residual_tolerance_mm: Positive | None = None
    interval_tolerance_mm: Positive | None = None
    accuracy: AccuracySettings | None = None
    watch_s: Annotated[float, Field(ge=5)] | None = None
    enable_input: Annotated[int, Field(ge=0, le=9999)] | None = None
    stop_on_silence_s: Annotated[float, Field(ge=1)] | None = None
    people: dict[Text, PersonRole] | None = None
    stations: dict[Text, StationSettings] | None = None
    notes: str | None = None

    @field_validator("people", mode="before")
    @classmethod
    def _roles_are_roles(cls, people: object) -> object:
        if not isinstance(people, dict):
            return people
        return {name: _role(name, role) for name, role in people.items()}

    @field_validator("url")
    @classmethod
    def _is_a_url(cls, url: str | None) -> str | None:
        if url is not None:
            parse_url(url)
        return url

    @field_validator("server_certificate", "user")
    @classmethod
    def _is_for_opc_ua(cls, said: str | None, info: ValidationInfo) -> str | None:
        # A URL that is wrong is missing from the data and already reported.
        url = info.data.get("url")
        if said is None or not url:
            return said
        if parse_url(url).medium != "opcua":
            raise ValueError(tr("has no meaning: the url is not one of OPC UA"))
        if info.field_name in parse_url(url).options:
            raise ValueError(tr("is in the url too: say it once"))
        return said

    @field_validator("acceleration_mm_s2")
    @classmethod
    def _applies(cls, stated: int | None, info: ValidationInfo) -> int | None:
        # A URL that is wrong is missing from the data and already reported.
        url = info.data.get("url")
        able = capabilities_of_kind(parse_url(url).kind) if stated is not None and url else None
        if able is not None and not able.acceleration:
            raise ValueError(tr("cannot apply: robolink does not move controllers of this kind"))
        return stated

    @field_validator("joint_accelerations")
    @classmethod
    def _belongs_to_the_speeds(
        cls, each: tuple[float, ...] | None, info: ValidationInfo
    ) -> tuple[float, ...] | None:
        # An invalid value is missing from the data and already reported.
        speeds = info.data.get("joint_speeds", ...)
        if speeds is not ... and len(speeds or ()) != len(each or ()):
            raise ValueError(tr("must have as many values as joint_speeds"))
        return each

    @field_validator("remote_timeout_confirmed_by")
    @classmethod
    def _confirms_something(cls, person: str | None, info: ValidationInfo) -> str | None:
        # An invalid value is missing from the data and already reported.
        stated = info.data.get("remote_timeout_s", ...)
        if stated is None and person is not None:
            raise ValueError(tr("confirms nothing: remote_timeout_s is missing"))
        if isinstance(stated, float) and person is None:
            raise ValueError(
                tr(
                    "is missing: who saw remote_timeout_s on the controller's Remote Ethernet "
                    "page, and when"
                )
            )
        return person

    @field_validator("clearance_mm")
    @classmethod
    def _stays_below_the_lift(
        cls, clearance_mm: float | None, info: ValidationInfo
    ) -> float | None:
        lift_mm = info.data.get("lift_mm")
        if lift_mm is not None and clearance_mm is not None and clearance_mm >= lift_mm:
            raise ValueError(tr("must be smaller than lift_mm"))
        return clearance_mm


def _role(name: str, role: object) -> PersonRole:
    try:
        return PersonRole(str(role))
    except ValueError:
        raise ValueError(
            tr("{name} is {role!r}: it must be operator or engineer", name=name, role=role)
        ) from None


class CellFile(BaseModel):
    """One whole ``robolink.toml``.

    Attributes:
        language: Of the sentences on screens.
        journal: Where the journal is of cells that name none of their own.
        home: The home of cells that name none of their own.
        keep_checks_days: For how many days checks of cells are kept on record.
        groups: Names of cells, or patterns over them, by the name of the group.
        cells: The cells by name.
    """

    model_config = STRICT

    language: str = ""
    journal: JournalPlace | None = None
    home: ComputerName | None = None
    keep_checks_days: Annotated[int, Field(ge=7, le=3650)] | None = None
    groups: dict[str, Annotated[tuple[Text, ...], Field(strict=False, min_length=1)]] = Field(
        default_factory=dict
    )
    plant: str = ""
    cells: dict[str, CellSettings] = Field(default_factory=dict)

    @field_validator("language")
    @classmethod
    def _is_spoken(cls, language: str) -> str:
        if language_named(language) is None and language:
            raise ValueError(tr("must be zh or en"))
        return language

    @field_validator("plant")
    @classmethod
    def _is_a_database(cls, plant: str) -> str:
        if not plant:
            return plant
        try:
            place = plant_place(plant)
        except ConfigError:
            # The sentence must not repeat the value.
            raise ValueError(tr("must be a URL: postgresql://user@host/database")) from None
        if place.url != place.location:
            raise ValueError(tr("holds a password: put that into ~/.pgpass or PGPASSWORD"))
        return plant
