"""Draws a held board from below, with its fiducials: round pads, crosses or ArUco markers."""

import math
from collections.abc import Callable
from typing import Final

import numpy as np

from robolink_simulators.pictures.scene import Placed, SeenBoard
from robolink_simulators.pictures.shading import (
    Grey,
    Patch,
    disc,
    lay,
    own_coordinates,
    soft_step,
)

BOARD_GREY: Final = 70.0
MARK_GREY: Final = 205.0
CLEAR_GREY: Final = 45.0
"""Around a fiducial the copper is left away, so that there the board is darker (assumed)."""

_ARUCO_BLACK: Final = 20.0
_ARUCO_WHITE: Final = 215.0
_CROSS_BAR: Final = 0.25

ARUCO_BITS: Final = (
    (0b0000, 0b1111, 0b1001, 0b1010),
    (0b0011, 0b0011, 0b0010, 0b1101),
    (0b1001, 0b1001, 0b0100, 0b0110),
    (0b0101, 0b0100, 0b1001, 0b1110),
)
"""Markers 1 to 4 of the dictionary 4x4_50, row by row; 1 is white: fiducial N has the id N."""


def draw_board(
    grey: Grey, board: SeenBoard, size_px: tuple[int, int], sigma_px: Callable[[float], float]
) -> None:
    """Draw a board over what is behind it.

    Args:
        grey: The picture.
        board: The board.
        size_px: Width and height of the picture.
        sigma_px: Returns the blur of a height above the plane of focus.
    """
    middle = board.middle
    sigma = sigma_px(middle.above_mm)
    half_x, half_y = board.half_mm
    reach = math.hypot(half_x, half_y) * middle.px_per_mm * 1.1 + 4 * sigma
    patch = Patch.about(middle.at_px, reach, size_px)
    if patch is None:
        return
    u, v = own_coordinates(patch, middle)
    sigma_mm = sigma / middle.px_per_mm
    inside = soft_step(np.float32(half_x) - np.abs(u), sigma_mm)
    inside *= soft_step(np.float32(half_y) - np.abs(v), sigma_mm)
    lay(patch.of(grey), inside, BOARD_GREY)
    for number, mark in enumerate(board.marks):
        _mark(grey, board, number, mark, size_px, sigma_px(mark.above_mm))


def _mark(
    grey: Grey,
    board: SeenBoard,
    number: int,
    mark: Placed,
    size_px: tuple[int, int],
    sigma_px: float,
) -> None:
    half_mm = board.mark_mm / 2
    reach = 2.2 * half_mm * mark.px_per_mm * 1.1 + 4 * sigma_px
    patch = Patch.about(mark.at_px, reach, size_px)
    if patch is None:
        return
    u, v = own_coordinates(patch, mark)
    sigma_mm = sigma_px / mark.px_per_mm
    part, out = patch.of(grey), np.hypot(u, v)
    if board.mark == "aruco":
        _aruco(part, u, v, half_mm, sigma_mm, ARUCO_BITS[number % len(ARUCO_BITS)])
        return
    lay(part, disc(out, 2 * half_mm, sigma_mm), CLEAR_GREY)
    if board.mark == "round":
        lay(part, disc(out, half_mm, sigma_mm), MARK_GREY)
        return
    bar_mm = half_mm * _CROSS_BAR
    for along, across in ((u, v), (v, u)):
        bar = _box(along, across, half_mm, bar_mm, sigma_mm)
        lay(part, bar, MARK_GREY)


def _aruco(
    part: Grey, u: Grey, v: Grey, half_mm: float, sigma_mm: float, bits: tuple[int, ...]
) -> None:
    """Draw a marker, 4 by 4 bits with a border of one bit, on a white field.

    It is printed on the underside of the board, so it reads right from below: seen from above its
    columns run against X.
    """
    bit_mm = half_mm / 3
    lay(part, _box(u, v, half_mm + bit_mm, half_mm + bit_mm, sigma_mm), _ARUCO_WHITE)
    lay(part, _box(u, v, half_mm, half_mm, sigma_mm), _ARUCO_BLACK)
    white = np.zeros_like(u)
    for row, line in enumerate(bits):
        for column in range(4):
            if line >> (3 - column) & 1:
                x, y = (1.5 - column) * bit_mm, (1.5 - row) * bit_mm
                # Blurred halves of neighbours add up to a whole without a seam.
                white += _box(u - x, v - y, bit_mm / 2, bit_mm / 2, sigma_mm)
    lay(part, white, _ARUCO_WHITE)


def _box(u: Grey, v: Grey, half_u: float, half_v: float, sigma: float) -> Grey:
    """Return how much of a blurred rectangle there is; exact, also where it is narrow."""
    return _strip(u, half_u, sigma) * _strip(v, half_v, sigma)


def _strip(at: Grey, half: float, sigma: float) -> Grey:
    width = np.float32(half)
    return soft_step(at + width, sigma) - soft_step(at - width, sigma)
