"""The answers of acts besides ``ok``, described once: the OpenAPI document is made from them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

from robolink.model import ToolOffset
from robolink_simulators.cell.places import XyzMm
from robolink_simulators.cell.surfaces import FlatPlate, RoundBall
from robolink_simulators.cell.tip_looks import ToldLook
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.device.wire_record import StartedMotion, WireLine
from robolink_simulators.faults.fieldbus import Order

Described = Any
"""The type of an answer: a dataclass or a union of dataclasses."""

LEFT_OUT: Final = "left out where it is as usual"
"""Marks a field that an answer omits while it has its usual value."""


@dataclass(frozen=True, slots=True)
class FlangePlace:
    """Where the flange is, in base coordinates."""

    x_mm: float
    y_mm: float
    z_mm: float
    u_deg: float


@dataclass(frozen=True, slots=True)
class CameraSeen:
    """The up-looking camera.

    Attributes:
        middle_mm: What the middle of its picture shows, in base coordinates.
        mm_per_px: By how much the base's X and Y change with a pixel across, and down.
        size_px: Width and height of its picture.
    """

    middle_mm: XyzMm
    mm_per_px: tuple[tuple[float, float], tuple[float, float]]
    size_px: tuple[int, int]


@dataclass(frozen=True, slots=True)
class BoardSeen:
    """The board that the mounted nozzle holds.

    Attributes:
        frame: Its frame, seen from the flange.
        drawing_mm: Where its marks are, in that frame.
    """

    frame: ToolOffset
    drawing_mm: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class MapTool:
    """A tool in the registers of a PLC, seen from the flange; null for what is not a number."""

    x_mm: float | None
    y_mm: float | None
    z_mm: float | None
    u_deg: float | None
    v_deg: float | None
    w_deg: float | None


@dataclass(frozen=True, slots=True)
class MapTruth:
    """The true state of a PLC with a register map, which has no world.

    Attributes:
        kind: The kind of controller.
        stored: The tools that it holds, by number.
        selected_tool: The one in force; none where the map names no place for it.
    """

    kind: Literal["plc"]
    stored: Mapping[str, MapTool]
    selected_tool: int | None


@dataclass(frozen=True, slots=True)
class CellTruth:
    """The true state of a controller, and of the cell around its robot.

    Attributes:
        kind: The kind of controller.
        stored: The tools that it holds, by number.
        selected_tool: The one in force, 0 for none.
        tips: Where the tips really are, seen from the flange, by number of the tool.
        pin_mm: The pin's top, in base coordinates.
        surface: What the person touches in the pin's place, if anything.
        operator_sigma_mm: Standard deviation of what the person's eye reads, per axis.
        camera: The up-looking camera.
        looks: How the tips look in drawn pictures, by number of the tool.
        board: The board that the mounted nozzle holds, if it holds one.
        parameters: What goes wrong in this cell.
    """

    kind: Literal["epson", "softmotion"]
    stored: Mapping[str, ToolOffset]
    selected_tool: int
    tips: Mapping[str, ToolOffset]
    pin_mm: XyzMm
    surface: FlatPlate | RoundBall | None
    operator_sigma_mm: float
    camera: CameraSeen
    looks: Mapping[str, ToldLook]
    board: BoardSeen | None
    parameters: WorldParameters


@dataclass(frozen=True, slots=True)
class Counters:
    """Counts since the simulator was made or reset.

    Attributes:
        exchanges: Requests answered.
        moves_started: Motions begun, whoever commanded them.
        tool_writes: Tools written or cleared.
        starts: How often the controller was switched on.
        touches: How often the person was asked to bring a tip onto something.
    """

    exchanges: int
    moves_started: int
    tool_writes: int
    starts: int
    touches: int


@dataclass(frozen=True, slots=True)
class ClockShown:
    """The simulated time.

    Attributes:
        simulated_s: Simulated seconds, from a zero that is the same for all cells of a process.
        factor: Simulated seconds per real one, 0 in a pause; none where time passes only while
            somebody waits.
    """

    simulated_s: float
    factor: float | None


@dataclass(frozen=True, slots=True)
class SnapshotNames:
    """The existing snapshots.

    Attributes:
        snapshots: Their names.
    """

    snapshots: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LinesTold:
    """The traffic on the wire.

    Attributes:
        lines: The last lines, oldest first.
        last: How many there were so far; to ask for what comes behind it, give it as ``after``.
    """

    lines: tuple[WireLine, ...]
    last: int


@dataclass(frozen=True, slots=True)
class MotionsTold:
    """The motions that began.

    Attributes:
        motions: The last ones, oldest first.
        moves_started: How many there were so far.
    """

    motions: tuple[StartedMotion, ...]
    moves_started: int


@dataclass(frozen=True, slots=True)
class FaultKeys:
    """A planned fault, as docs/fault-plans.md explains; keys with default values are left out.

    Attributes:
        action: What goes wrong.
        on_exchange: Which of the requests that match, counted from 0.
        match: Text that a request must contain to be counted.
        seconds: A delay, in simulated time.
        code: The number of an error.
        position: A byte, a word or a segment.
        bit: Which bit of it.
        order: Of words.
        every: It goes on, with every so many-th request that matches, until it is removed.
    """

    action: str
    on_exchange: Annotated[int, LEFT_OUT]
    match: Annotated[str, LEFT_OUT]
    seconds: Annotated[float, LEFT_OUT]
    code: Annotated[int, LEFT_OUT]
    position: Annotated[int, LEFT_OUT]
    bit: Annotated[int, LEFT_OUT]
    order: Annotated[Order, LEFT_OUT]
    every: Annotated[int, LEFT_OUT]


@dataclass(frozen=True, slots=True)
class FaultsTold:
    """The planned faults.

    Attributes:
        fired: The last that have happened, oldest first.
        times_fired: How many have happened.
        pending: The first of those that wait, in the order in which they were planned.
        waiting: How many wait.
    """

    fired: tuple[FaultKeys, ...]
    times_fired: int
    pending: tuple[FaultKeys, ...]
    waiting: int


@dataclass(frozen=True, slots=True)
class FlangeTold:
    """Where the flange stopped.

    Attributes:
        flange: There.
    """

    flange: FlangePlace


@dataclass(frozen=True, slots=True)
class TipTold:
    """The nozzle that is mounted now.

    Attributes:
        tip: Where its tip is, seen from the flange.
    """

    tip: ToolOffset


@dataclass(frozen=True, slots=True)
class MarksSeen:
    """What a picture shows.

    Attributes:
        seen: The pixels, across and down, of what looks like the mark.
        radii_px: The radius of each, empty where the finder tells none.
    """

    seen: tuple[tuple[float, float], ...]
    radii_px: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class WaySeen:
    """A vector.

    Attributes:
        way_mm: It, in base axes.
    """

    way_mm: XyzMm


@dataclass(frozen=True, slots=True)
class WorldTold:
    """The imperfections of a cell.

    Attributes:
        parameters: All of them.
    """

    parameters: WorldParameters


@dataclass(frozen=True, slots=True)
class CellAbout:
    """What a simulated controller is.

    Attributes:
        kind: The kind of controller.
        machine: Kind and model.
        seed: Decides its world and every scatter.
        urls: Where clients of the controller connect to, by link.
        acts: The names of what can be done to it.
        version: Of robolink.
    """

    kind: Literal["epson", "softmotion", "plc"]
    machine: str
    seed: int
    urls: Mapping[str, str]
    acts: tuple[str, ...]
    version: str


@dataclass(frozen=True, slots=True)
class CellsAbout:
    """What is simulated here.

    Attributes:
        cells: Each controller, by name.
    """

    cells: Mapping[str, CellAbout]
