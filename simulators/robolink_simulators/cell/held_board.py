"""A board that the mounted nozzle holds, never quite as it should."""

import random
from dataclasses import dataclass, replace
from typing import Final

from robolink.model import ToolOffset, rotate_xy
from robolink_simulators.cell.frames import Frame, printed_angles, zyx
from robolink_simulators.cell.places import XyzMm

DRAWING_MM: Final = ((20.0, 12.5), (-20.0, 12.5), (-20.0, -12.5), (20.0, -12.5))
"""Fiducials of the simulated board: a rectangle about its middle."""


@dataclass(frozen=True, slots=True)
class SimulatedBoard:
    """A board at the tip of a nozzle.

    Attributes:
        shift_mm: From the nozzle's tip to the board's middle, in the nozzle's axes.
        turn_deg: By how much the board is turned against the nozzle.
        drawing_mm: Its fiducials, about its middle.
    """

    shift_mm: tuple[float, float]
    turn_deg: float
    drawing_mm: tuple[tuple[float, float], ...] = DRAWING_MM

    @classmethod
    def grasped(cls, rng: random.Random) -> "SimulatedBoard":
        """Return a board as a nozzle takes it up: some tenths of a mm, and a degree, off."""
        x_mm, y_mm = (round(rng.uniform(-0.5, 0.5), 4) for _ in range(2))
        return cls((x_mm, y_mm), round(rng.uniform(-1.5, 1.5), 4))

    def frame(self, tip: ToolOffset) -> ToolOffset:
        """Return the board's frame on the flange, for a nozzle with its tip there."""
        return _moved(tip, (*self.shift_mm, 0.0), self.turn_deg)

    def fiducials(self, tip: ToolOffset) -> tuple[ToolOffset, ...]:
        """Return where the fiducials are on the flange."""
        frame = self.frame(tip)
        return tuple(_moved(frame, (x, y, 0.0), 0.0) for x, y in self.drawing_mm)


def _moved(tip: ToolOffset, by_mm: XyzMm, turn_deg: float) -> ToolOffset:
    """Return the frame that is shifted in a tool's own axes and turned about its Z."""
    if not tip.v_deg and not tip.w_deg:
        dx, dy = rotate_xy(*by_mm[:2], tip.u_deg)
        return replace(tip, x_mm=tip.x_mm + dx, y_mm=tip.y_mm + dy, u_deg=tip.u_deg + turn_deg)
    x_mm, y_mm, z_mm, u_deg, v_deg, w_deg = tip.components()
    there = Frame((x_mm, y_mm, z_mm), zyx(u_deg, v_deg, w_deg)) @ Frame(by_mm, zyx(turn_deg, 0, 0))
    return ToolOffset(*there.shift_mm, *printed_angles(there.rotation))
