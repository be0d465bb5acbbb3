"""What a calibration method declares: its parameters, for commands, recipes, schema and docs.

A method is one module, or a folder of two or three. Its parameters are one frozen dataclass; the
annotation of each field says its limits (``annotated_types``), its unit and the sentence that help,
schema and docs show. The command ``calibrate NAME``, the recipe's ``[source]`` and the page of all
methods are made from it.
"""

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Final, Generic, Literal, TypeVar

from annotated_types import Ge, Le

from robolink.files.toml import Problem
from robolink.stations import StationKind

if TYPE_CHECKING:
    from pathlib import Path

    from robolink.model import Controller, Recorded, TipSensor, ToolOffset
    from robolink.pose_tables import ReadingChoices
    from robolink.procedures import KeptProof, PoseMethod, TipSource
    from robolink.stations import Station


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Where a method measures, and for what.

    Attributes:
        controller: The controller, connected.
        tool: Number of the tool.
        station: What is known of the station; its name is empty where nobody named one.
        points: Numbers of the taught points that touch the pin, where they are measured with.
        pose_file: A file of poses in place of the points, and what it does not say itself.
        sigma_mm: Standard deviation of one coordinate of one measurement, where it is known.
        max_change_mm: Largest change that is believed.
        interval_mm: Largest half width of a 95 % interval that is believed, if one is judged.
        sensor: The camera: open, or its name or URL; it goes before what parameters and station
            say. ``None`` leaves it to them. One that is open is left open.
    """

    controller: "Controller"
    tool: int
    station: "Station"
    points: tuple[int, ...] = ()
    pose_file: "tuple[Path, ReadingChoices] | None" = None
    sigma_mm: float | None = None
    max_change_mm: float = 2.0
    interval_mm: float | None = None
    sensor: "str | TipSensor | None" = None

    def stating(self, **details: object) -> "Station":
        """Return the station with what the parameters state; ``None`` states nothing."""
        said = {name: value for name, value in details.items() if value is not None}
        return replace(self.station, details={**self.station.details, **said})


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolHistory:
    """The records of a tool at a station: what is known before anything is connected.

    Attributes:
        station: Name of the station.
        kept: Entries of the tool that say that a value stays, the newest first.
        holds: What the tool was seen to hold last, ``None`` where nothing says it.
        sigma_mm: Standard deviation of one coordinate of one measurement, where it is stated.
        interval_mm: Largest half width of a 95 % interval that is believed, if one is judged.
    """

    station: str
    kept: "Iterable[Recorded]"
    holds: "ToolOffset | None" = None
    sigma_mm: float | None = None
    interval_mm: float | None = None


@dataclass(frozen=True, slots=True)
class Unit:
    """The unit of a parameter, as people read it."""

    name: str


@dataclass(frozen=True, slots=True)
class Help:
    """The meaning of a parameter; the sentence of help, recipe schema and docs."""

    sentence: str


_UNSET: Final = object()


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """How a command offers a parameter, if that does not follow from its name.

    Attributes:
        flag: Its name on the command line; else the field's without its unit.
        metavar: What stands for the value in the help.
        default: What a command takes when nobody typed it, where that differs from what a recipe
            that does not say it means.
        moves: Whether it says how to move, and so means nothing for poses that exist already.
        chooses: The value that the option, then a flag, stands for.
        from_recipe: Key at the top of a recipe that says it, in place of one in ``[source]``.
    """

    flag: str = ""
    metavar: str = ""
    default: object = _UNSET
    moves: bool = True
    chooses: object = _UNSET
    from_recipe: str = ""

    def default_or(self, usual: object) -> object:
        """Return the value that a command uses when nobody typed one."""
        return usual if self.default is _UNSET else self.default

    @property
    def is_choice(self) -> bool:
        """Whether the option is a flag that stands for one value."""
        return self.chooses is not _UNSET


MM: Final = Unit("mm")
DEGREES: Final = Unit("degrees")
MM_S: Final = Unit("mm/s")

Length = Annotated[float, Ge(0.001), MM]
"""A limit, in mm; no smaller than the last digit that a controller prints."""

Angle = Annotated[float, Ge(-360), Le(360), DEGREES]
InputNumber = Annotated[int, Ge(0), Le(0xFFFF)]
Pair = tuple[float, float]
Rows = tuple[Pair, Pair]


LengthRule = Literal["ask", "difference", "keep"]
"""Rule if a tip is longer or shorter: ask, write Z by difference, or keep Z."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedLimits:
    """Limits that a person stated for this one measurement; ``None`` for the others.

    What a cell allows every method is not stated: a method that cannot be judged by it is not.

    Attributes:
        sigma_mm: Standard deviation of one coordinate of one measurement.
        rms_mm: Largest root mean square of the residuals.
        max_mm: Largest residual.
        interval_mm: Largest half width of a 95 % interval.
    """

    sigma_mm: float | None = None
    rms_mm: float | None = None
    max_mm: float | None = None
    interval_mm: float | None = None


NOTHING_STATED: Final = StatedLimits()


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """What is known when the parameters are checked together.

    Attributes:
        given: The parameters that somebody wrote.
        limits: What was stated besides; ``None`` where that cannot be told.
        box_height_mm: Height of the box in which the flange may go, ``None`` where it is not known.
        poses_exist: Whether the poses exist already, so that nothing is measured at set angles.
        points: How many taught points were named, ``None`` where none are.
        spell: Returns a parameter's name as whoever wrote it knows it: a key, or an option.
    """

    given: Collection[str] = ()
    limits: StatedLimits | None = None
    box_height_mm: float | None = None
    poses_exist: bool = False
    points: int | None = None
    spell: Callable[[str], str] = str

    @property
    def sigma_stated(self) -> bool | None:
        """Whether the standard deviation was stated; ``None`` if that is unknown."""
        return None if self.limits is None else self.limits.sigma_mm is not None


@dataclass(frozen=True, kw_only=True)
class MethodParameters:
    """What the parameters of all methods have in common."""

    def problems(self, check: Check) -> Iterator[Problem]:  # noqa: ARG002 - for overriding
        """Yield what is wrong between parameters that are right by themselves.

        The place of a problem is the name of a field, with ``#2`` for the second of a list.
        """
        yield from ()

    def no_residual(self) -> str:
        """Return why residuals cannot be judged, empty if they can."""
        return ""

    def sigma_gain(self) -> float | None:
        """Return the tip's standard deviation as a multiple of a measurement's, if known."""
        return None

    def length_rule(self) -> LengthRule:
        """Return what to do if the touches show that the tip is longer or shorter."""
        return "ask"

    def states_station(self) -> bool:
        """Return whether they state all about the station, so that it need not be known."""
        return False

    def height_mm(self) -> float:
        """Return how far above the box the flange goes."""
        return 0.0

    def room_mm(self) -> float:
        """Return how high the box has to be at least, for lifting the tip off and coming back."""
        return 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Needs:
    """What a method needs in the cell.

    Attributes:
        station: What it measures at.
        named: Whether the station has to be named, because it must be known in advance.
        finds_pin: Whether it finds the pin itself; the place goes on record.
        sensor: Whether a camera takes part.
        tilt: Whether the robot has to tilt its tool, so that it also works on a tilted flange.
        motion: Whether the robot moves.
        place: What X and Y of the station are to the method, and what Z is, to tell a recipe in
            which they are missing; empty where the place may be unknown.
    """

    station: StationKind
    named: bool = True
    finds_pin: bool = False
    sensor: bool = False
    tilt: bool = False
    motion: bool = True
    place: tuple[str, str] | None = None

    @property
    def by_sensor(self) -> bool:
        """Whether beams, a switch or a camera measure, and no person touches anything."""
        return self.motion and self.named and self.station is not StationKind.PIN


@dataclass(frozen=True, slots=True)
class PoseHelp:
    """The help's sentences on poses that exist already: taught, typed, in a file."""

    points: str
    typed: str
    path: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Former:
    """A kind of source by which recipes used to name the method.

    Attributes:
        kind: The old ``source.kind``.
        method: The old ``source.method`` that went with it, empty for none.
        usual: Whether it was meant where no method was named.
    """

    kind: str
    method: str = ""
    usual: bool = False


@dataclass(frozen=True, slots=True)
class NextStep:
    """What a person does next with a tool that was measured and written.

    Attributes:
        step: Its name for programs.
        sentence: What it is for, a sentence.
        command: The command that does it, after ``robolink`` and the name of the cell.
    """

    step: str
    sentence: str
    command: str

    def as_json(self) -> dict[str, object]:
        """Return it as plain JSON."""
        return {"step": self.step, "sentence": self.sentence, "command": f"robolink {self.command}"}


P = TypeVar("P", bound=MethodParameters)


@dataclass(frozen=True, slots=True, kw_only=True)
class Method(Generic[P]):
    """A calibration method.

    Attributes:
        name: The one name: of the command, of the recipe's kind, in the docs.
        summary: What it does, in one line.
        description: What it does, for the help of the command.
        parameters: Its parameters.
        measures: The components of the offset that it tells.
        needs: What it needs in the cell.
        source: Makes what measures, from the parameters and where it is.
        from_poses: Makes what solves poses that exist already, ``None`` where it needs the robot.
        pose_help: What the help says about such poses.
        tells_height: Whether the flange's height at the touch tells Z, beside what is solved.
        by_reference: Whether basis "difference" compares with a reference that a run records.
        unmeasured_z: Why ``z = "measured"`` is refused, empty where Z can be measured.
        formerly: How recipes named it before.
        proof: Returns the type of its proof, a frozen dataclass, so that one which a change left
            open can be read back; ``None`` where it has none of its own.
        changes_left: Tells from the record after how many more changes a full calibration is due,
            0 for now; it returns ``None`` where the record does not say it, and is ``None`` where
            each change is a full calibration.
        next_steps: Tells what a person does next with the tool of that number, once it is
            written; ``None`` where nothing follows from the method.
    """

    name: str
    summary: str
    description: str
    parameters: type[P]
    measures: tuple[str, ...]
    needs: Needs
    source: "Callable[[P, Site], TipSource]"
    from_poses: "Callable[[P, Site], PoseMethod] | None" = None
    pose_help: PoseHelp | None = None
    tells_height: bool = False
    by_reference: bool = True
    unmeasured_z: str = ""
    formerly: tuple[Former, ...] = ()
    proof: "Callable[[], type[KeptProof]] | None" = None
    changes_left: Callable[[P, ToolHistory], int | None] | None = None
    next_steps: Callable[[int], tuple[NextStep, ...]] | None = None

    @property
    def only_z(self) -> bool:
        """Whether it measures Z and nothing else."""
        return self.measures == ("z_mm",)


AnyMethod = Method[Any]
