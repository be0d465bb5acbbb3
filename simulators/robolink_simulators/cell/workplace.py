"""The place where a simulated robot works: tips, a pin, a camera, a board.

Ground truth. The controller knows none of it; only what it stores.
"""

import math
import random
from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping
from dataclasses import asdict, replace
from typing import Any, ClassVar, Final, Protocol

from robolink.messages import tr
from robolink.model import TIP, Pose, ToolOffset
from robolink_simulators.cell.camera import CameraTruth, SimulatedBoard
from robolink_simulators.cell.frames import add
from robolink_simulators.cell.places import Axis, Direction, Pixel, axis_of
from robolink_simulators.cell.places import XyzMm as XyzMm
from robolink_simulators.cell.surfaces import (
    FlatPlate,
    RoundBall,
    Surface,
    SurfaceContact,
    resistance_n,
)
from robolink_simulators.cell.tip_looks import TipLook, look_drawn
from robolink_simulators.cell.tip_switches import (
    STANDING,
    UPRIGHT,
    Lean,
    LightBeam,
    PinContact,
    Shaft,
    TipSwitch,
)
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.device.wire_time import late_random
from robolink_simulators.not_now import NotNowError

_STRAIGHT: Final = Shaft()

MOUNTED_TOOL: Final = 1
"""The tool number of the nozzle mounted on the arm."""


class Handled(Protocol):
    """A robot as a person at the cell handles it."""

    def placement(self) -> Hashable:
        """Return a value that stays equal as long as the robot stands still."""

    def flange(self) -> Pose:
        """Return the commanded flange pose."""

    def tip_mm(self, tip: ToolOffset | None) -> XyzMm:
        """Return where a physical tip is, given where it sits on the flange."""

    def turned(self, direction: Direction) -> Direction:
        """Return how a direction on the flange lies in the base."""

    def carry(self, tip: ToolOffset | None, by_mm: XyzMm) -> None:
        """Jog until the tip has moved that far; the flange turns as little as possible.

        What it cannot reach it refuses with the error of its own controller.
        """

    def turn(self, by_deg: float) -> None:
        """Turn the flange about the base's Z where it stands; where it cannot, it stays."""

    def loosen(self, parameters: WorldParameters) -> None:
        """Give the axes the backlash in the parameters."""


class Workplace(ABC):
    """The truth around a robot.

    Args:
        robot: Who works here.
        tips: The physical tip of each tool number, seen from the flange.
        pin_mm: Tip of the reference pin.
        seed: Decides the next nozzles, where the camera is, and how a board is held.
        replaced: What the next nozzle differs from where no tip is known yet.
        parameters: What goes wrong here; see :meth:`set_up`.

    Attributes:
        inputs: How many inputs the controller has.
        leans: By how much the nozzle of a tool is bent; upright where none is named.
        camera: The up-looking camera.
        board: The board that the mounted nozzle holds, ``None`` for none.
        set_ups: How often parameters were given; pictures count from the last time.
    """

    inputs: ClassVar[int]

    def __init__(
        self,
        robot: Handled,
        tips: dict[int, ToolOffset],
        pin_mm: XyzMm,
        *,
        seed: int,
        replaced: ToolOffset,
        parameters: WorldParameters,
    ) -> None:
        self.robot = robot
        self.tips = tips
        self.pin_mm = pin_mm
        self.leans: dict[int, Lean] = {}
        self.board: SimulatedBoard | None = None
        self.set_ups = 0
        self._seed = seed
        self._random = late_random(f"nozzles {seed}")
        self._replaced = replaced
        self.parameters = WorldParameters()
        tip_mm = self.tip_mm()
        middle_mm = camera_beside(tip_mm, random.Random(f"camera {seed}"))
        rng = late_random(f"camera {seed}", first=lambda drawn: camera_beside(tip_mm, drawn))
        self.camera = CameraTruth(middle_mm, parameters.optics, rng)
        self.set_up(parameters)

    def set_up(self, parameters: WorldParameters) -> None:
        """Give the cell other imperfections; tips, pin and camera stay in place.

        Raises:
            NotNowError: The contact is to switch an input that the controller does not have.
        """
        self._wire_contact(parameters)
        if parameters.tool_turn != self.parameters.tool_turn:
            u_deg, v_deg, w_deg = parameters.tool_turn
            tip = self.tips.get(MOUNTED_TOOL, self._replaced)
            self.tips[MOUNTED_TOOL] = replace(tip, u_deg=u_deg, v_deg=v_deg, w_deg=w_deg)
        self.parameters = parameters
        self.operator_sigma_mm = parameters.eye_sigma_mm
        self.leans[MOUNTED_TOOL] = parameters.lean
        self.camera.optics = parameters.optics
        self.camera.moved_mm = parameters.camera_moved
        self.set_ups += 1
        self.camera.finder.set_up(parameters.finder_faults)
        self.robot.loosen(parameters)
        if not parameters.board_held:
            self.board = None
        elif self.board is None:
            self.board = SimulatedBoard.grasped(random.Random(f"board {self._seed}"))

    def gap_mm(self, tool: int = MOUNTED_TOOL) -> XyzMm:
        """Return the vector from a physical tip to the pin, or to the touched surface."""
        tip, surface = self.tip_mm(tool), self.surface
        if surface is not None:
            return surface.way_mm(tip)
        return self.pin_mm[0] - tip[0], self.pin_mm[1] - tip[1], self.pin_mm[2] - tip[2]

    @property
    def surface(self) -> Surface | None:
        """What the person touches in place of the pin; it goes through the pin's top."""
        said = self.parameters
        if said.person_touches == "plane":
            lean_deg, toward_deg = said.plane_lean_deg, said.plane_lean_toward_deg
            return FlatPlate.leaning(self.pin_mm, lean_deg, toward_deg)
        if said.person_touches == "sphere":
            return RoundBall.under(self.pin_mm, said.sphere_radius_mm)
        return None

    def touch_begins(self, done: int) -> None:
        """Do what happens between two touches: somebody bumps the pin.

        Args:
            done: How many touches came before.
        """
        bump = self.parameters.bump
        if done and done == bump.after_touch:
            (dx, dy), (x_mm, y_mm, z_mm) = bump.by_mm, self.pin_mm
            self.pin_mm = (x_mm + dx, y_mm + dy, z_mm)

    @abstractmethod
    def connect(
        self, number: int, switch: TipSwitch, tool: int = MOUNTED_TOOL, *, noise_mm: float = 0.0
    ) -> None:
        """Connect an input of the controller to something that the tip trips.

        Args:
            number: The input.
            switch: What the tip meets.
            tool: Whose tip.
            noise_mm: Standard deviation, per axis, of where it switches; drawn anew for each
                movement.
        """

    @abstractmethod
    def disconnect(self, number: int) -> None:
        """Disconnect an input, which is then off."""

    def _wire_contact(self, parameters: WorldParameters) -> None:
        number = parameters.contact_input
        if number is not None and number >= self.inputs:
            raise NotNowError(
                tr("The simulated controller has no input {number}.", number=number),
                remedy=tr("Give one from 0 to {last}.", last=self.inputs - 1),
            )
        before = self.parameters.contact_input
        if self.parameters.contact == parameters.contact:
            return
        if before is not None:
            self.disconnect(before)
        if number is not None:
            self.connect(number, self._contact(parameters))

    def _contact(self, parameters: WorldParameters) -> TipSwitch:
        if parameters.person_touches == "pin":
            return PinContact(lambda: self.pin_mm, parameters.pin_radius_mm)

        def touched() -> Surface:
            # By then these parameters are in force.
            return self.surface or FlatPlate(self.pin_mm, STANDING)

        return SurfaceContact(touched)

    def resistance_n(self, tip_mm: XyzMm) -> XyzMm:
        """Return the force, N, of the touched object on a tip at a place; see :mod:`.surfaces`."""
        return resistance_n(tip_mm, self.pin_mm, self.parameters.pin_radius_mm, self.surface)

    def lean_of(self, tool: int) -> Lean:
        """Return by how much a nozzle is bent, in the flange's axes."""
        return self.leans.get(tool, UPRIGHT)

    def shaft_of(self, tool: int) -> Shaft:
        """Return the shaft of a nozzle, in the flange's axes."""
        bent_up_to_mm = self.parameters.lean_up_to_mm if tool == MOUNTED_TOOL else 0.0
        lean = self.lean_of(tool)
        return Shaft(lean, bent_up_to_mm) if bent_up_to_mm or lean != UPRIGHT else _STRAIGHT

    def beside(self, switch: TipSwitch, tip_mm: XyzMm) -> XyzMm:
        """Return where a switch meets a tip, relative to its mounting place: beams may be moved."""
        if not isinstance(switch, LightBeam):
            return tip_mm
        (dx, dy), (x_mm, y_mm, z_mm) = self.parameters.beams_moved, tip_mm
        return x_mm - dx, y_mm - dy, z_mm

    def see(self, mark: int = TIP) -> tuple[Pixel, ...]:
        """Take a picture and return everything in it that looks like the tip, or a fiducial.

        Fiducials look alike: every one in the image is found, whichever is asked for.
        """
        return self.camera.picture(place for place, _ in self.marks(mark))

    def spots(self, mark: int = TIP) -> tuple[tuple[float, float, float | None], ...]:
        """Take a picture as :meth:`see` does; with each pixel the radius, where it is told."""
        seen, finder = self.see(mark), self.camera.finder
        return tuple((x, y, finder.radius_px()) for x, y in seen)

    def marks(self, mark: int = TIP) -> list[tuple[XyzMm, Direction]]:
        """Return where the tips are, or all fiducials, and how the X axis of each lies."""
        nozzle, board = self.tips.get(MOUNTED_TOOL, ToolOffset()), self.board
        if mark == TIP:
            # A board held by the nozzle hides its tip.
            shown = [tool for tool in self.tips if not (board and tool == MOUNTED_TOOL)]
            seen = [(self.seen_tip_mm(tool), self.axis("x", tool)) for tool in shown]
            second_mm = self.second_tip_mm()
            return seen if second_mm is None else [*seen, (second_mm, self.axis("x"))]
        held = board.fiducials(nozzle) if board else ()
        return [(self.robot.tip_mm(p), self.robot.turned(axis_of(p, "x"))) for p in held]

    def second_tip_mm(self) -> XyzMm | None:
        """Return where another nozzle beside the mounted one is; ``None`` where there is none."""
        beside_mm = self.parameters.second_tip_mm
        if beside_mm is None or self.board is not None:
            return None
        return add(self.tip_mm(), self.robot.turned((*beside_mm, 0.0)))

    def look_of(self, tool: int = MOUNTED_TOOL) -> TipLook:
        """Return how the end of a tool looks from below; another nozzle looks otherwise."""
        tip = self.tips.get(tool, ToolOffset())
        place = " ".join(f"{at:.4f}" for at in tip.components()[:3])
        return look_drawn(self.parameters.tip_build, f"{self._seed} {tool} {place}")

    def seen_tip_mm(self, tool: int) -> XyzMm:
        """Return where a camera sees a physical tip: off by a vector that is fixed in the tool."""
        x_mm, y_mm = self.parameters.tip_seen_beside_mm
        if not x_mm and not y_mm:
            return self.tip_mm(tool)
        return add(self.tip_mm(tool), self.robot.turned((x_mm, y_mm, 0.0)))

    def tip_mm(self, tool: int = MOUNTED_TOOL) -> XyzMm:
        """Return where a physical tip is now; the mounted one with its spindle's wobble."""
        x_mm, y_mm, z_mm = self.robot.tip_mm(self.tips.get(tool))
        if tool != MOUNTED_TOOL or not self.parameters.wobble_mm:
            return x_mm, y_mm, z_mm
        toward = math.radians(2 * self.robot.flange().u_deg + self.parameters.wobble_toward_deg)
        wobble_mm = self.parameters.wobble_mm
        return x_mm + wobble_mm * math.cos(toward), y_mm + wobble_mm * math.sin(toward), z_mm

    def told_flange(self) -> Pose:
        """Return where the flange is by the controller's report."""
        return self.robot.flange()

    def axis(self, axis: Axis, tool: int = MOUNTED_TOOL) -> Direction:
        """Return how an axis of a physical tool lies in the base now."""
        return self.robot.turned(axis_of(self.tips.get(tool, ToolOffset()), axis))

    def change_nozzle(self, tool: int = MOUNTED_TOOL) -> ToolOffset:
        """Put another nozzle on; its tip is some tenths of a mm from the old one's."""
        self.tips[tool] = exchanged(self.tips.get(tool, self._replaced), self._random)
        return self.tips[tool]

    def truth(self) -> dict[str, Any]:
        """Return all of it, ready for JSON."""
        return {
            "tips": {str(tool): asdict(tip) for tool, tip in self.tips.items()},
            "pin_mm": list(self.pin_mm),
            "surface": asdict(self.surface) if self.surface else None,
            "operator_sigma_mm": self.operator_sigma_mm,
            "camera": {
                "middle_mm": list(self.camera.middle_mm),
                "mm_per_px": [list(row) for row in self.camera.optics.mm_per_px],
                "size_px": list(self.camera.optics.size_px),
            },
            "looks": {str(tool): asdict(self.look_of(tool).told()) for tool in self.tips},
            "board": self._held(),
            "parameters": asdict(self.parameters),
        }

    def moment(self) -> dict[str, Any]:
        """Return copies of the present state of this place, except for the next random values."""
        return {
            "tips": dict(self.tips),
            "pin_mm": self.pin_mm,
            "leans": dict(self.leans),
            "middle_mm": self.camera.middle_mm,
            "parameters": self.parameters,
            "nozzles": self._random.getstate(),
        }

    def put_back(self, moment: Mapping[str, Any]) -> None:
        """Restore what :meth:`moment` returned; the eye's errors start again."""
        self.set_up(moment["parameters"])
        self.tips, self.pin_mm = dict(moment["tips"]), moment["pin_mm"]
        self.leans = dict(moment["leans"])
        self.camera.middle_mm = moment["middle_mm"]
        self._random.setstate(moment["nozzles"])

    def _held(self) -> dict[str, Any] | None:
        if self.board is None:
            return None
        frame = self.board.frame(self.tips.get(MOUNTED_TOOL, ToolOffset()))
        return {"frame": asdict(frame), "drawing_mm": [list(at) for at in self.board.drawing_mm]}


def exchanged(old: ToolOffset, rng: random.Random) -> ToolOffset:
    """Return where the tip of another nozzle sits: some tenths of a mm from the old one's."""
    x_mm, y_mm, z_mm = (_signed(rng, 0.2, 0.6) for _ in range(3))
    return replace(old, x_mm=old.x_mm + x_mm, y_mm=old.y_mm + y_mm, z_mm=old.z_mm + z_mm).rounded(4)


def pin_beside(tip_mm: XyzMm, rng: random.Random) -> XyzMm:
    """Return a pin some mm beside a tip and below it."""
    return (
        round(tip_mm[0] + _signed(rng, 5.0, 9.0), 3),
        round(tip_mm[1] + _signed(rng, 5.0, 9.0), 3),
        round(tip_mm[2] - rng.uniform(3.0, 6.0), 3),
    )


def camera_beside(tip_mm: XyzMm, rng: random.Random) -> XyzMm:
    """Return where a camera looks: nearer to the robot's base than a tip, and below it."""
    reach_mm = math.hypot(tip_mm[0], tip_mm[1])
    inward, beside = rng.uniform(12.0, 18.0) / reach_mm, _signed(rng, 4.0, 8.0) / reach_mm
    return (
        round(tip_mm[0] * (1 - inward) - tip_mm[1] * beside, 3),
        round(tip_mm[1] * (1 - inward) + tip_mm[0] * beside, 3),
        round(tip_mm[2] - rng.uniform(6.0, 9.0), 3),
    )


def _signed(rng: random.Random, low_mm: float, high_mm: float) -> float:
    return rng.choice((-1.0, 1.0)) * rng.uniform(low_mm, high_mm)
