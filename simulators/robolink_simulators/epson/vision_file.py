"""A vision project in a file: what RC+ stores beside the programs, and the camera's properties.

docs/spel-programs.md, "Vision" shows one and explains its keys.
"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Protocol, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from robolink.files.key_problems import is_not_known, sentence
from robolink.files.toml import FileKind, Problem
from robolink.messages import tr
from robolink.model import TIP, Pose
from robolink_simulators.cell.workplace import Workplace
from robolink_simulators.cell.world_parameters import parameters_from_text
from robolink_simulators.epson.camera_calibrations import CameraMounting, VisionCalibration
from robolink_simulators.epson.condition import SpelRefusal
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.epson.vision_project import (
    VisionObject,
    VisionProject,
    VisionSequence,
    VisionValue,
)
from robolink_simulators.epson.vision_system import VisionSystem

SCHEMA: Final = "robolink/vision/1"

VISION_FILE: Final = FileKind(
    named=lambda path: tr("The vision project {path}", path=path),
    unreadable_remedy=lambda: tr("docs/spel-programs.md shows what a vision project looks like."),
    wrong_remedy=lambda: tr("Correct it; docs/spel-programs.md explains every key."),
)

_Name = Annotated[str, Field(min_length=1, max_length=32)]
_Fiducial = Annotated[int, Field(ge=1, le=99)]
_Number = Annotated[float, Field(ge=-1e6, le=1e6)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class _Object(_Table):
    name: _Name
    mark: Literal["tip"] | _Fiducial = "tip"
    properties: dict[str, VisionValue] = {}


class _Sequence(_Table):
    name: _Name
    properties: dict[str, VisionValue] = {}
    object: Annotated[list[_Object], Field(min_length=1, max_length=64)]


class _Calibration(_Table):
    name: _Name
    mounting: Literal["standalone", "fixed_downward", "fixed_upward"] = "fixed_upward"
    exact: bool = False
    points: Annotated[list[list[_Number]], Field(max_length=1000)] = []
    poses: Annotated[list[list[_Number]], Field(max_length=1000)] = []

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if [self.exact, bool(self.points), bool(self.poses)].count(True) != 1:
            raise ValueError(tr("needs one of exact, points and poses"))
        if any(len(row) != 4 for row in (*self.points, *self.poses)):
            raise ValueError(tr("needs four numbers for each point and each pose"))
        return self


class _Document(_Table):
    schema_name: Annotated[Literal["robolink/vision/1"], Field(alias="schema")]
    world: dict[str, bool | int | float | str] = {}
    sequence: Annotated[list[_Sequence], Field(max_length=64)] = []
    calibration: Annotated[list[_Calibration], Field(max_length=16)] = []


_KNOWN: Final[dict[str, type[_Table]]] = {"sequence": _Sequence, "object": _Object}
_KNOWN["calibration"] = _Calibration


class VisionHost(Protocol):
    """A simulated controller, as its vision system needs it.

    Attributes:
        options: Its habits.
        program: What runs its programs.
        seed: Decides the scores of what is found.
    """

    options: EpsonOptions
    program: Any
    seed: int

    @property
    def world(self) -> Workplace:
        """What there is to see."""
        ...


def install_vision(simulator: VisionHost, path: Path) -> VisionSystem:
    """Give a simulated controller's program a vision system, as a file describes it.

    Args:
        simulator: A controller with a program.
        path: The file.

    Raises:
        ConfigError: It cannot be read, or something in it is wrong: all of it at once.
    """
    document = _read(path)
    world = simulator.world
    texts = {name: str(value) for name, value in document.world.items()}
    changes: dict[str, Any] = parameters_from_text(texts)
    world.set_up(replace(world.parameters, **changes))
    exact = VisionCalibration.of_camera(world.camera)
    try:
        project = _project(document, exact)
    except SpelRefusal as refusal:
        raise VISION_FILE.refusal(path, [Problem("", refusal.text)]) from refusal
    vision = VisionSystem(project, lambda: simulator.world, simulator.options, seed=simulator.seed)
    simulator.program.vision = vision
    return vision


def _read(path: Path) -> _Document:
    parsed = VISION_FILE.parse(path, VISION_FILE.read(path))
    try:
        return _Document.model_validate(parsed)
    except ValidationError as error:
        details = error.errors(include_url=False, include_input=False)
        raise VISION_FILE.refusal(path, [_problem(detail) for detail in details]) from error


def _problem(detail: Any) -> Problem:  # noqa: ANN401 - pydantic's own form
    place = [part + 1 if isinstance(part, int) else str(part) for part in detail["loc"]]
    if detail["type"] != "extra_forbidden":
        return Problem(".".join(map(str, place)), sentence(detail))
    tables = [_KNOWN[part] for part in place if part in _KNOWN]
    fields = (tables[-1] if tables else _Document).model_fields
    known = [field.alias or name for name, field in fields.items()]
    return Problem(".".join(map(str, place)), is_not_known(str(place[-1]), known))


def _project(document: _Document, exact: VisionCalibration) -> VisionProject:
    sequences = [
        VisionSequence(
            one.name,
            [
                VisionObject(it.name, TIP if it.mark == "tip" else it.mark, it.properties)
                for it in one.object
            ],
            one.properties,
        )
        for one in document.sequence
    ]
    made = {one.name: _calibration(one, exact) for one in document.calibration}
    project = VisionProject.of(sequences, **made)
    for one in document.calibration:
        if one.poses:
            project.taught[one.name.lower()] = tuple(
                Pose(x_mm, y_mm, z_mm, u_deg) for x_mm, y_mm, z_mm, u_deg in one.poses
            )
    return project


def _calibration(given: _Calibration, exact: VisionCalibration) -> VisionCalibration:
    mounting = CameraMounting[given.mounting.upper()]
    if given.points:
        pixels = [(row[0], row[1]) for row in given.points]
        places = [(row[2], row[3]) for row in given.points]
        return replace(VisionCalibration.of_points(pixels, places), mounting=mounting)
    return replace(exact, mounting=mounting, complete=given.exact)
