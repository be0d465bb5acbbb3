"""The tables of a recipe: keys, units and limits. Imported when one is loaded, for pydantic.

The sentence below a key is what an editor shows for it; the schema is made of them.
"""

import dataclasses
import functools
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, create_model
from pydantic_core import CoreSchema

from robolink.methods import AnyMethod, Help, MethodParameters, Unit, all_methods, fields_of
from robolink.methods.parameter_checks import ParameterField as Parameter
from robolink.methods.parameter_checks import bare
from robolink.model import Pose, WorkBox

Line = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
"""One line for people. No control characters: they would reach a terminal."""

Note = Annotated[str, Field(max_length=5000, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f]*$")]
"""Text for people, of several lines."""

Length = Annotated[float, Field(ge=0.001)]
"""Smallest limit: the last digit that a controller prints, in mm (docs/reference/rules.md 3)."""

Angle = Annotated[float, Field(ge=-360, le=360)]
ToolNumber = Annotated[int, Field(ge=1, le=15)]
OutputNumber = Annotated[int, Field(ge=0, le=0xFFFF)]
PointNumber = Annotated[int, Field(ge=0, le=999)]


class Table(BaseModel):
    """What all tables share."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        hide_input_in_errors=True,
        use_attribute_docstrings=True,
    )


class FlangePose(Table):
    """Where the flange (Tool 0) is, in base coordinates."""

    x_mm: float
    """X of the flange, base, mm."""
    y_mm: float
    """Y of the flange, base, mm."""
    z_mm: float
    """Z of the flange, base, mm."""
    u_deg: float
    """U of the flange, degrees."""
    v_deg: Angle = 0.0
    """V of the flange, degrees; "pivot", "plane-touch", "sphere-touch" and "six-point" only, whose
    robots can tilt it."""
    w_deg: Angle = 0.0
    """W of the flange, degrees; likewise."""

    @property
    def pose(self) -> Pose:
        """The same as a pose."""
        return Pose(self.x_mm, self.y_mm, self.z_mm, self.u_deg, self.v_deg, self.w_deg, tool=0)


class StationTable(Table):
    """Where the tools are measured."""

    id: Line
    """Name of the pin or gauge, recorded with every measurement. Coordinates that this table leaves
    out come from the station of that name in the cell file and the journal."""
    x_mm: float | None = None
    """X of the pin's end (for the record only), of the place where the surface is touched, or of
    the place where a camera looks; base, mm. Give y_mm too."""
    y_mm: float | None = None
    """Y of the same; base, mm. Give x_mm too."""
    z_mm: float | None = None
    """Z of the pin's end, of the surface, or of the height in focus; base, mm; from here or from
    the station's record. Source "z-touch" always needs it, and z = "measured" if basis is
    "absolute"."""
    sigma_mm: Length | None = None
    """Standard deviation of each of them, mm, if it is known. Source "one-touch" with basis
    "absolute" needs it to state what it is repeatable to."""
    note: Note = ""
    """Notes for people."""

    @property
    def place_mm(self) -> tuple[float, float, float]:
        """Where it is, once stated by the recipe or the record."""
        x_mm, y_mm, z_mm = self.x_mm, self.y_mm, self.z_mm
        assert x_mm is not None  # noqa: S101 - the recipe was checked and located
        assert y_mm is not None  # noqa: S101
        assert z_mm is not None  # noqa: S101
        return x_mm, y_mm, z_mm


class Poses(Table):
    """Poses of the whole change."""

    safe: FlangePose | None = None
    """Flange pose to which the robot moves first and last: up, across, down."""
    turn_back: bool = True
    """Whether U turns back to that of the safe pose at the end; if false, the robot ends at the
    place of the safe pose with the U of the last turn test, and whatever moves it next turns it."""


class PoseFile(Table):
    """A file of poses, and what the file itself leaves open (docs/poses.md, "Files of poses")."""

    file: Line
    """Path of the file. A relative path begins in the folder of the recipe."""
    columns: Line | None = None
    """A name for each column of the file, such as "x,y,z,u"; "-" skips one."""
    length: Literal["mm", "cm", "m", "in"] | None = None
    """Unit of the lengths."""
    euler: Line | None = None
    """Rule of the rotation angles, such as "kuka"."""


class Tool(Table):
    """One tool whose nozzle was changed."""

    number: ToolNumber
    """Number of the tool in the controller."""
    name: Line | None = None
    """Name of the tool for people."""
    approach: FlangePose | None = None
    """Flange pose from which the tool is measured, with the tip some mm beside the pin and above
    it. Without this pose, the tool is measured from the robot's present position."""
    retreat: FlangePose | None = None
    """Flange pose to which the robot moves after the measurement."""
    points: Annotated[tuple[PointNumber, ...], Field(strict=False, min_length=2)] | None = None
    """Numbers, 0 to 999, of the taught points that touch the pin with this tool: 2 for "two-pose",
    3 and more for "n-angle". For source "points" only, which needs them or a file of poses."""
    poses: PoseFile | None = None
    """File with the poses that touch the pin with this tool, instead of points."""


class Speeds(Table):
    """How fast the robot goes, in Power Low."""

    percent: Annotated[int, Field(ge=1, le=100)] = 5
    """Speed of joint moves, percent of the speed in Power Low."""
    mm_s: Annotated[float, Field(ge=1, le=100)] = 20.0
    """Speed of straight moves, mm/s."""


class Box(Table):
    """How far the flange may go from where the recipe starts."""

    sideways_mm: Annotated[float, Field(ge=1)] = 150.0
    """Largest distance in X and in Y, mm."""
    down_mm: Annotated[float, Field(ge=1)] = 30.0
    """Largest distance down, mm."""
    up_mm: Annotated[float, Field(ge=1)] = 50.0
    """Largest distance up, mm."""

    @property
    def reach(self) -> WorkBox:
        """The same, around any later place of the flange."""
        return WorkBox.reaching(self.sideways_mm, down_mm=self.down_mm, up_mm=self.up_mm)


class Tolerances(Table):
    """Acceptance limits."""

    rms_mm: Length | None = None
    """Largest rms of the residuals, mm; not for "two-pose", which leaves no residual."""
    max_mm: Length | None = None
    """Largest single residual, mm, at least rms_mm; not for "two-pose"."""
    interval_mm: Length | None = None
    """Largest value that the result may be accurate to in 95 %, mm: all measured lengths together,
    with every row of the budget, see [accuracy]. "two-pose" needs sigma_mm for it."""
    sigma_mm: Length | None = None
    """Standard deviation of one coordinate of one touch or crossing, mm, if it is known."""
    jump_mm: Length = 2.0
    """Largest change of the stored offset that a nozzle change explains, mm, over all measured
    lengths together; more is refused. A typed Z is not judged."""
    drift_mm: Length = 0.2
    """Largest drift that passes the turn test, mm."""


HalfWidth = Annotated[float, Field(ge=0.0001)]


class AccuracyTable(Table):
    """Errors that no measurement shows by itself, as half widths.

    A row that is left out counts as in the cell file, as on record, or by its default
    (docs/accuracy.md).
    """

    touch_mm: HalfWidth | None = None
    """Largest error of the point at which a person sees contact, always on the same side of the
    tool, mm."""
    place_mm: HalfWidth | None = None
    """Largest movement of the station since it was learnt, mm; only if the method uses the place of
    the station."""
    camera_turn_deg: HalfWidth | None = None
    """Largest turn of the camera since its calibration, degrees."""
    camera_scale_percent: HalfWidth | None = None
    """Largest change of the camera's scale since its calibration, percent."""
    plate_mm: HalfWidth | None = None
    """Largest error in the height of the surface, mm."""
    tip_image_px: HalfWidth | None = None
    """Largest distance between the middle of a tip and the point where the camera sees the tip,
    pixels."""
    bend_deg: HalfWidth | None = None
    """Largest bend of the needle that may be left after its correction, degrees."""
    print_mm: HalfWidth | None = None
    """Largest deviation of the printed fiducials from their drawing, mm."""

    @property
    def stated(self) -> dict[str, float]:
        """The stated values, by key."""
        return {key: value for key, value in self.model_dump().items() if value is not None}


class RefusalTable(Table):
    """What follows when a measurement is refused."""

    action: Literal["stop", "measure_again"] = "stop"
    """End the change with the old values, or measure that tool again."""
    attempts: Annotated[int, Field(ge=2, le=5)] | None = None
    """Largest number of measurements of a tool; 2 if left out."""


class Prompt(Table):
    """A question to a person."""

    at: Literal["start", "before_measure", "before_write", "end"]
    """Time of the question: once at start, before_write and end; before_measure for each tool."""
    text: Line
    """Question as the person reads it."""
    answer: Literal["yes", "nozzle", "lot", "text"] = "yes"
    """Kind of answer: a yes, without which the change ends; the nozzle's id, its lot, or a text to
    record."""
    tool: ToolNumber | None = None
    """Ask before this tool only."""


class Output(Table):
    """An output that is switched: vacuum, purge, light."""

    at: Literal["start", "before_measure", "after_measure", "before_write", "end"]
    """Time of switching: once at start, before_write and end; before and after the measurement of
    each tool."""
    output: OutputNumber
    """Number of the output bit."""
    on: bool
    """Whether the output is switched on or off."""
    tool: ToolNumber | None = None
    """Switch it for this tool only."""


_DESCRIBED = ConfigDict(use_attribute_docstrings=False)
"""Configuration of tables whose keys have their own descriptions: pydantic need not read the source
of every module."""


class MethodTable(Table):
    """What the tables of all methods share."""

    model_config = _DESCRIBED

    of_method: ClassVar[AnyMethod]

    kind: str
    """Name of the method."""

    @property
    def parameters(self) -> MethodParameters:
        """The parameters of the method."""
        made: MethodParameters = self.of_method.parameters(
            **{
                one.name: _plain(getattr(self, one.name))
                for one in fields_of(self.of_method.parameters)
                if one.in_recipe
            }
        )
        return made


class _Line(Table):
    """A table inside another, such as a light beam."""

    model_config = _DESCRIBED

    of_class: ClassVar[type[Any]]


class AnyKind:
    """Stands for the table of whatever method ``kind`` names."""

    def __get_pydantic_core_schema__(
        self, _source: object, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Return the union of the tables of all present methods."""
        tables = tuple(map(method_table, all_methods()))
        return handler.generate_schema(
            Annotated[Union[tables], Field(discriminator="kind")]  # noqa: UP007 - made at run time
        )


_tables: dict[str, type[MethodTable]] = {}
_lines: dict[type[Any], type[_Line]] = {}


def method_table(method: AnyMethod) -> type[MethodTable]:
    """Return the table of a method."""
    made = _tables.get(method.name)
    if made is None or made.of_method is not method:
        made = _tables[method.name] = _made_of(method)
    return made


def _made_of(method: AnyMethod) -> type[MethodTable]:
    keys: dict[str, Any] = {
        one.name: (_annotation(one), _default(one))
        for one in fields_of(method.parameters)
        if one.in_recipe
    }
    name = "".join(part.title() for part in method.name.split("-"))
    made = create_model(
        f"{name}Source",
        __base__=MethodTable,
        __doc__=method.summary,
        **{"kind": (Literal[method.name], Field(description=method.summary)), **keys},
    )
    made.of_method = method
    return made


def _default(one: Parameter) -> Any:  # noqa: ANN401 - pydantic's own form
    meaning = f"{one.help} [{one.unit}]" if one.unit else one.help
    return Field(... if one.required else one.default, description=meaning)


def _annotation(one: Parameter) -> Any:  # noqa: ANN401 - a type
    made = _typed(one.kind, one.metadata)
    return made if one.required or one.default is not None else made | None


def _typed(kind: Any, limits: tuple[object, ...]) -> Any:  # noqa: ANN401 - types
    """Return a type with its limits, for pydantic; a list in TOML is a tuple here."""
    limits = tuple(limit for limit in limits if not isinstance(limit, (Help, Unit)))
    if get_origin(kind) is tuple:
        inner, *more = get_args(kind)
        if more != [Ellipsis]:
            limits = (*limits, Field(min_length=len(more) + 1, max_length=len(more) + 1))
        element = _typed(*bare(inner))
        kind, limits = tuple[element, ...], (Field(strict=False), *limits)  # type: ignore[valid-type]
    elif isinstance(kind, type) and dataclasses.is_dataclass(kind):
        kind = _line(kind)
    return functools.reduce(lambda made, limit: Annotated[made, limit], limits, kind)


def _line(kind: type[Any]) -> type[_Line]:
    if kind in _lines:
        return _lines[kind]
    keys: dict[str, Any] = {one.name: (_annotation(one), _default(one)) for one in fields_of(kind)}
    made = create_model(kind.__name__, __base__=_Line, __doc__=kind.__doc__, **keys)
    made.of_class = kind
    _lines[kind] = made
    return made


def _plain(value: object) -> object:
    """Return a value of a table as the parameters hold it."""
    if isinstance(value, tuple):
        return tuple(map(_plain, value))
    if isinstance(value, _Line):
        return value.of_class(
            **{name: _plain(getattr(value, name)) for name in type(value).model_fields}
        )
    assert not isinstance(value, BaseModel)  # noqa: S101 - there are no other tables inside
    return value
