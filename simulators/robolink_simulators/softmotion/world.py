"""The truth behind a simulated SoftMotion machine, and the person beside it."""

import random
from collections.abc import Hashable
from contextlib import suppress
from typing import Final

from robolink.messages import tr
from robolink.model import AxisKind, OrientationSpace, Pose, ToolOffset
from robolink_simulators.cell.frames import (
    Z_AXIS,
    Frame,
    about,
    add,
    product,
    subtract,
    turned,
    zyx_angles,
)
from robolink_simulators.cell.person import SimulatedOperator
from robolink_simulators.cell.places import Direction
from robolink_simulators.cell.tip_switches import STANDING, UPRIGHT, Lean, Shake, TipSwitch, meets
from robolink_simulators.cell.workplace import (
    MOUNTED_TOOL,
    Workplace,
    XyzMm,
    exchanged,
    pin_beside,
)
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.not_now import NotNowError
from robolink_simulators.softmotion.group.axis_group import AxisGroup
from robolink_simulators.softmotion.group.condition import SmcGroupState
from robolink_simulators.softmotion.kinematics.kinematics import AxisValues, KinematicsModel
from robolink_simulators.softmotion.signals import SIGNALS
from robolink_simulators.softmotion.smc_errors import BlockRefused, ErrorKind

STORED: Final = ToolOffset(12.0, -3.5, -20.0)
"""The nozzle mounted before, on a kinematics that accepts any tool."""

_STANCE: Final = 0.6
_ARRIVED_MM = 1e-9
_MOST_TRIES = 100


class SoftMotionWorld(Workplace):
    """Ground truth around a simulated axis group.

    Args:
        group: The robot in this world.
        tips: The physical tip of each tool number, seen from the flange.
        pin_mm: Tip of the reference pin, in MCS.
        seed: Decides the next nozzles and the errors of the eye.
        stored: The nozzle that was there before.
        parameters: What goes wrong here.

    Attributes:
        operator: The person at the cell, who jogs with the machine's own panel.
        stored: The nozzle that was there before.

    Example:
        >>> from robolink import ToolOffset
        >>> from robolink_simulators.softmotion import SoftMotionWorld
        >>> from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
        >>> group, tip = SoftMotionSimulator().plc.group, ToolOffset(12, -4, 60)
        >>> stored = ToolOffset(12, -3, 60)
        >>> world = SoftMotionWorld(group, {1: tip}, (300, 100, 50), seed=7, stored=stored)
        >>> world.pin_mm, world.tips[1].y_mm
        ((300, 100, 50), -4)
    """

    inputs = SIGNALS

    def __init__(
        self,
        group: AxisGroup,
        tips: dict[int, ToolOffset],
        pin_mm: XyzMm,
        *,
        seed: int,
        stored: ToolOffset,
        parameters: WorldParameters | None = None,
    ) -> None:
        self.group = group  # its inputs are wired below
        self._seen: tuple[KinematicsModel, AxisValues, Frame] | None = None
        super().__init__(
            _HandledGroup(group),
            tips,
            pin_mm,
            seed=seed,
            replaced=stored,
            parameters=parameters or WorldParameters(),
        )
        self.stored = stored
        self.operator = SimulatedOperator(self, require_jogging=self._require_rest, seed=seed)

    @classmethod
    def seeded(
        cls, group: AxisGroup, seed: int, parameters: WorldParameters | None = None
    ) -> "SoftMotionWorld":
        """Set up a nozzle change: the tip is some tenths of a mm from where it was.

        The machine is put where the physical tip stands some mm beside the pin and above it.
        What is stored, and which tool is set, is up to the PLC program.

        Args:
            group: The robot in this world.
            seed: Decides the nozzles and the errors of the eye.
            parameters: What goes wrong here.

        Example:
            >>> from robolink_simulators.softmotion import SoftMotionWorld
            >>> from robolink_simulators.softmotion.mailbox import SoftMotionSimulator
            >>> world = SoftMotionWorld.seeded(SoftMotionSimulator().plc.group, seed=7)
            >>> world.tips[1] == world.stored
            False
        """
        rng = random.Random(f"softmotion world {seed}")
        group.place(tuple(_stance(axis.limits.low, axis.limits.high) for axis in group.axes))
        image = group.kinematics.orientation_image(group.flange().rotation)
        stored = STORED if image is None else _fitting(STORED, image)
        tip = exchanged(stored, rng)
        if image is not None:
            tip = _fitting(tip, image)
        pin_mm = pin_beside(_tip_at(group, group.values, tip), rng)
        return cls(
            group, {MOUNTED_TOOL: tip}, pin_mm, seed=seed, stored=stored, parameters=parameters
        )

    def connect(
        self, number: int, switch: TipSwitch, tool: int = MOUNTED_TOOL, *, noise_mm: float = 0.0
    ) -> None:
        """Connect an input of the group to a beam or a plate that the tip trips.

        Args:
            number: The input.
            switch: What the tip meets.
            tool: Whose tip.
            noise_mm: Standard deviation, per axis, of where it switches; drawn anew for each
                movement.
        """
        group, shake = self.group, Shake(noise_mm, random.Random(f"input {number} {self._seed}"))

        def sense(axes: AxisValues) -> bool:
            flange = self._flange_at(trailing(group, axes))
            tip_mm = flange.point(_shift(self.tips.get(tool)))
            place = add(tip_mm, shake.of(group.movements_started))
            shaft = self.shaft_of(tool)
            return meets(
                switch,
                self.beside(switch, place),
                _way_at(flange, shaft.lean),
                bent_up_to_mm=shaft.bent_up_to_mm,
                upright=lambda: _way_at(flange, UPRIGHT),
            )

        group.inputs.connect(number, sense)

    def _flange_at(self, true_axes: AxisValues) -> Frame:
        """Return where the flange is; a search asks in each cycle, once for each beam."""
        kinematics = self.group.kinematics
        if self._seen is None or self._seen[0] is not kinematics or self._seen[1] != true_axes:
            self._seen = (kinematics, true_axes, kinematics.flange(true_axes))
        return self._seen[2]

    def disconnect(self, number: int) -> None:
        """Disconnect an input, which is then off."""
        self.group.inputs.switch(number, on=False)

    def _require_rest(self) -> None:
        if self.group.state not in (SmcGroupState.DISABLED, SmcGroupState.STANDBY):
            raise NotNowError(
                tr("The machine cannot be jogged by hand while it moves or is in error."),
                remedy=tr("Wait for the end of the movement, or reset the error first."),
            )


class _HandledGroup:
    """Implements :class:`~robolink_simulators.cell.workplace.Handled`."""

    def __init__(self, group: AxisGroup) -> None:
        self._group = group

    def placement(self) -> Hashable:
        return self._group.values

    def flange(self) -> Pose:
        flange = self._group.flange()
        return Pose(*flange.shift_mm, *zyx_angles(flange.rotation), tool=0)

    def tip_mm(self, tip: ToolOffset | None) -> XyzMm:
        group = self._group
        return _tip_at(group, trailing(group, group.values), tip)

    def turned(self, direction: Direction) -> Direction:
        return _turned_at(self._group, trailing(self._group, self._group.values), direction)

    def turn(self, by_deg: float) -> None:
        group, kinematics = self._group, self._group.kinematics
        here = kinematics.flange(group.values)
        wanted = Frame(here.shift_mm, product(about(Z_AXIS, by_deg), here.rotation))
        with suppress(BlockRefused):
            configuration = kinematics.configuration(group.values)
            group.place(kinematics.axes_for(wanted, configuration, group.values))

    def loosen(self, parameters: WorldParameters) -> None:
        for axis in self._group.axes:
            rotary = axis.kind is AxisKind.ROTARY
            axis.play = parameters.backlash_deg if rotary else parameters.backlash_mm

    def carry(self, tip: ToolOffset | None, by_mm: XyzMm) -> None:
        """Try again while the flange turns with the arms and takes the tip along."""
        group, kinematics = self._group, self._group.kinematics
        axes = group.values
        target = add(_tip_at(group, axes, tip), by_mm)
        configuration = kinematics.configuration(axes)
        for _ in range(_MOST_TRIES):
            flange = kinematics.flange(axes)
            arm = turned(flange.rotation, _shift(tip))
            wanted = Frame(subtract(target, arm), flange.rotation)
            axes = kinematics.axes_for(wanted, configuration, axes)
            missed = subtract(target, _tip_at(group, axes, tip))
            if max(map(abs, missed)) < _ARRIVED_MM:
                group.place(axes)
                return
        raise BlockRefused(ErrorKind.UNREACHABLE, "The tip cannot be brought there")


def _stance(low: float, high: float) -> float:
    return low + _STANCE * (high - low)


def _fitting(tip: ToolOffset, image: OrientationSpace) -> ToolOffset:
    """Return as much of a tip as the kinematics can accept."""
    shift = (tip.x_mm, tip.y_mm, tip.z_mm)
    return ToolOffset(*subtract(shift, image.impossible(shift)))


def _tip_at(group: AxisGroup, axes: AxisValues, tip: ToolOffset | None) -> XyzMm:
    return group.kinematics.flange(axes).point(_shift(tip))


def trailing(group: AxisGroup, axes: AxisValues) -> AxisValues:
    """Return where the true axes are with their encoders at ``axes``."""
    return tuple(axis.trailing(value) for axis, value in zip(group.axes, axes, strict=True))


def _way_at(flange: Frame, lean: Lean) -> Direction:
    """Return the direction of a leaning shaft, in base axes."""
    if lean == UPRIGHT:
        return STANDING
    x, y, _ = turned(flange.rotation, (*lean, 0.0))
    return x, y, 1.0


def _turned_at(group: AxisGroup, axes: AxisValues, direction: Direction) -> Direction:
    return turned(group.kinematics.flange(axes).rotation, direction)


def _shift(tip: ToolOffset | None) -> XyzMm:
    return (0.0, 0.0, 0.0) if tip is None else (tip.x_mm, tip.y_mm, tip.z_mm)
