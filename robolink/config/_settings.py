"""What one ``[cells.NAME]`` table may say. Imported when a file is loaded, for pydantic."""

from typing import Annotated

from pydantic import BaseModel, Field, ValidationInfo, field_validator

from robolink.config._accuracy_settings import AccuracySettings
from robolink.config._station_settings import STRICT, StationSettings
from robolink.locale.languages import language_named
from robolink.messages import tr
from robolink.model import PersonRole
from robolink.transport import parse_url

Text = Annotated[str, Field(min_length=1)]
Positive = Annotated[float, Field(gt=0)]


class CellSettings(BaseModel):
    """One cell: how to reach it, and the limits of work there. What is not said is ``None``.

    The limits are those of the options of the same name; an option on the command line wins.

    Attributes:
        url: The controller's URL.
        robot: Model of the robot that must be found there.
        tool: Number of the tool that is selected whenever nothing is being measured.
        password_file: File whose first line is the password, seen from the cell file.
        password_env: Environment variable that holds the password.
        timeout_s: Longest wait for one answer.
        remote_timeout_s: The remote time-out set in the controller, which cannot be read over
            the wire (docs/reference/epson.md 1.1).
        remote_timeout_confirmed_by: Who looked at the controller's setting, and when.
        speed_mm_s: Speed of moves, in low power.
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
    timeout_s: Positive | None = None
    remote_timeout_s: Positive | None = None
    remote_timeout_confirmed_by: Annotated[Text | None, Field(validate_default=True)] = None
    speed_mm_s: Annotated[float, Field(ge=1, le=100)] | None = None
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

    @field_validator("remote_timeout_confirmed_by")
    @classmethod
    def _confirms_something(cls, person: str | None, info: ValidationInfo) -> str | None:
        # A value that is wrong itself is missing in the data, and told already.
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
    """One whole ``robolink.toml``."""

    model_config = STRICT

    language: str = ""
    cells: dict[str, CellSettings] = Field(default_factory=dict)

    @field_validator("language")
    @classmethod
    def _is_spoken(cls, language: str) -> str:
        if language_named(language) is None and language:
            raise ValueError(tr("must be zh or en"))
        return language
