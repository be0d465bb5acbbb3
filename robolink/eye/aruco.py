"""Finds ArUco markers of a board by OpenCV, which the extra ``eye-usb`` brings.

Fiducial N of the board is the marker with the id N, from 1. A marker with another id is a
candidate that is refused: the robot looks at another place of the board than it should
(docs/reference/eye.md, "Fiducials of a board").
"""

import math
from collections.abc import Iterator
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from robolink.errors import ConfigError
from robolink.eye._mark_edges import (
    Numbers,
    edge_width,
    leaves_picture,
    line_through,
    noise_of,
    sampled,
    smoothed_slope,
)
from robolink.eye.candidate import (
    Candidate,
    CandidateRefusal,
    MarkShape,
    Polarity,
    RefusalCode,
    ranked,
)
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.eye.picture import Grey

__all__ = ["ARUCO_FAMILIES", "find_aruco"]

Places = npt.NDArray[np.float64]
"""Places or directions in a picture: two numbers each, X and Y."""

ARUCO_FAMILIES: Final = {
    "aruco": "DICT_4X4_50",
    "aruco-5x5": "DICT_5X5_50",
    "aruco-6x6": "DICT_6X6_50",
    "aruco-7x7": "DICT_7X7_50",
}
"""Names of the families, and the dictionary of each: its first fifty markers."""

_LEAST_CONTRAST: Final = 6.0
_LEAST_CONTRAST_NOISES: Final = 1.5
_BLURRED: Final = 2.0
_MOST_UNEQUAL: Final = 0.20
"""By how much its sides may differ: a board that leans by 10 degrees makes 2 %."""

_LEAST_RAYS: Final = 0.60
_SMOOTH_PX: Final = 1.2
_REACHES: Final = (0.13, 0.06, 0.06)
"""How far from a side its edge is looked for, as shares of its length; a module is a sixth."""

_ALONG: Final = np.linspace(0.08, 0.92, 32)
"""Where the edge of a side is looked for, as shares of its length."""


def find_aruco(
    grey: "Grey", shape: MarkShape, *, number: int, family: str = "aruco"
) -> tuple[Candidate, ...]:
    """Return all that may be the marker with an id, the accepted ones first.

    Its place is where its diagonals meet, its radius half the mean of its sides. What has the
    outline of a marker and no known pattern is not told: a picture is full of that.

    Args:
        grey: A picture, rows by columns.
        shape: What is known of the markers: half a side in pixels. ``bright`` is for markers that
            are printed inverted, white on black.
        number: The id that is looked for.
        family: One of :data:`ARUCO_FAMILIES`.

    Raises:
        ConfigError: OpenCV is not installed, or has no ArUco markers.
    """
    _opencv()
    if min(grey.shape) < 2 * shape.radius_px or shape.radius_px < 4:
        return ()
    detector = _detector(family, shape.polarity)
    noise = noise_of(grey)
    found = [
        _judged(grey, shape, corners, its, number, noise)
        for corners, its in (*_detected(detector, grey), *_detected(detector, grey, mirrored=True))
    ]
    return ranked(found, apart_px=0.5 * shape.radius_px)


def _detected(
    detector: Any,  # noqa: ANN401 - OpenCV's
    grey: "Grey",
    *,
    mirrored: bool = False,
) -> Iterator[tuple[Places, int]]:
    """Yield corners and id of each marker, also in a picture that a mirror or a driver turned over.

    Turned over, no marker of a family looks like another: they differ by more bits than are
    corrected.
    """
    seen = np.ascontiguousarray(grey[:, ::-1] if mirrored else grey)
    corners, ids, _others = detector.detectMarkers(seen)
    if ids is None:
        return
    for four, its in zip(corners, np.ravel(ids), strict=True):
        places = np.asarray(four, np.float64).reshape(4, 2)
        if mirrored:
            places[:, 0] = grey.shape[1] - 1 - places[:, 0]
        yield places, int(its)


def _opencv() -> ModuleType:
    try:
        import cv2  # 0.1 s, and not everybody has it
    except ImportError as error:
        raise ConfigError(
            tr("ArUco markers need OpenCV, which is not installed."),
            remedy=tr(
                "Install it: pip install 'robolink[eye-usb]'. Round pads and crosses do "
                "not need it."
            ),
        ) from error
    if not hasattr(cv2, "aruco"):
        raise ConfigError(
            tr("This OpenCV has no ArUco markers."),
            remedy=tr("Install it anew: pip install 'robolink[eye-usb]'."),
        )
    return cv2


@cache
def _detector(family: str, polarity: Polarity) -> Any:  # noqa: ANN401 - OpenCV's
    cv2 = _opencv()
    aruco: Any = cv2.aruco
    dictionary = aruco.getPredefinedDictionary(getattr(aruco, ARUCO_FAMILIES[family]))
    parameters = aruco.DetectorParameters()
    parameters.detectInvertedMarker = polarity is not Polarity.DARK
    return aruco.ArucoDetector(dictionary, parameters)


def _judged(
    grey: "Grey", shape: MarkShape, corners: Places, its: int, number: int, noise: float
) -> Candidate:
    """Return a marker with all that speaks against it.

    Args:
        grey: The picture.
        shape: What is known of the markers.
        corners: Its corners in turn, four by two.
        its: Its id.
        number: The id that is looked for.
        noise: Noise of the picture.
    """
    contrast = _sides(grey, corners)[0]
    met = 0.0
    for share in _REACHES:
        corners, met = _refined(grey, corners, share, bright_around=contrast > 0)
    x, y = _crossing(corners)
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    radius = float(sides.mean()) / 2
    unequal = float(sides.max() / max(1e-6, sides.min())) - 1
    contrast, edge_px = _sides(grey, corners)
    inverted = contrast < 0
    wrong_way = shape.polarity is (Polarity.DARK if inverted else Polarity.BRIGHT)
    least_contrast = max(_LEAST_CONTRAST, _LEAST_CONTRAST_NOISES * noise)
    off = abs(radius / shape.radius_px - 1)
    cut_px = max(leaves_picture(grey, float(cx), float(cy), 1.0) for cx, cy in corners)
    blurred = edge_px or 0.0
    blur_limit = math.inf if shape.edge_px is None else _BLURRED * shape.edge_px
    faint = abs(contrast) < least_contrast or wrong_way
    checks = (
        (RefusalCode.OTHER_MARK, its, number, its != number),
        (RefusalCode.CUT, cut_px, 0.0, cut_px > 0),
        (RefusalCode.OTHER_RADIUS, off, shape.within, off > shape.within),
        (RefusalCode.NOT_ROUND, unequal, _MOST_UNEQUAL, unequal > _MOST_UNEQUAL),
        (RefusalCode.FEW_RAYS, met, _LEAST_RAYS, met < _LEAST_RAYS),
        (RefusalCode.FAINT_EDGE, contrast, least_contrast, faint),
        (RefusalCode.BLURRED, blurred, blur_limit, blurred > blur_limit),
    )
    refused = tuple(
        CandidateRefusal(code, float(value), float(limit))
        for code, value, limit, fails in checks
        if fails
    )
    return Candidate(x, y, radius, met, rays=met, edge_px=edge_px, refused=refused)


def _crossing(corners: Places) -> tuple[float, float]:
    """Return where the diagonals of four corners meet: the middle also where the board leans."""
    a, b, c, d = corners
    one, other, between = c - a, d - b, b - a
    turn = one[0] * other[1] - one[1] * other[0]
    if abs(turn) < 1e-9:
        return float(corners[:, 0].mean()), float(corners[:, 1].mean())
    along = (between[0] * other[1] - between[1] * other[0]) / turn
    x, y = a + along * one
    return float(x), float(y)


def _profiles(grey: "Grey", corners: Places, reach: float, step: float) -> tuple[Numbers, Numbers]:
    """Return places across a side, and the levels there, by side and place, inside first."""
    across = np.arange(-reach, reach + step / 2, step, dtype=np.float32)
    following = np.roll(corners, -1, axis=0)
    along = following - corners
    lengths = np.hypot(*along.T)[:, None]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.maximum(lengths, 1e-6)
    inward = ((corners - corners.mean(axis=0)) * outward).sum(axis=1) < 0
    outward[inward] *= -1
    base = corners[:, None, :] + _ALONG[None, :, None] * along[:, None, :]
    x = base[..., 0, None] + across * outward[:, None, 0, None]
    y = base[..., 1, None] + across * outward[:, None, 1, None]
    return across, sampled(grey, x, y)


def _refined(
    grey: "Grey", corners: Places, share: float, *, bright_around: bool
) -> tuple[Places, float]:
    """Return where the lines through the edges of the sides meet, and the share of edges found.

    OpenCV's corners are those of pixels, and its own refinement of them errs by half a pixel.
    """
    reach = max(3.0, share * float(np.hypot(*(corners[1] - corners[0]))))
    step = 0.5
    across, levels = _profiles(grey, corners, reach, step)
    slopes = smoothed_slope(levels.reshape(-1, len(across)), _SMOOTH_PX / step)
    slopes = (slopes if bright_around else -slopes).reshape(levels.shape)
    inner = slopes[..., 1:-1]
    at = inner.argmax(axis=2) + 1
    index = at[..., None] + np.arange(-1, 2)
    before, here, after = np.moveaxis(np.take_along_axis(slopes, index, axis=2), 2, 0)
    bend = before - 2 * here + after
    shift = np.where(bend < 0, 0.5 * (before - after) / np.where(bend < 0, bend, -1), 0)
    places = across[at] + step * np.clip(shift, -0.5, 0.5)
    met = here > 0.3 * float(np.median(here))
    lines = list[tuple[Places, Places]]()
    following = np.roll(corners, -1, axis=0)
    middle = corners.mean(axis=0)
    good = 0
    for side, (one, other) in enumerate(zip(corners, following, strict=True)):
        along = other - one
        length = float(np.hypot(*along)) or 1e-6
        outward = np.array((along[1], -along[0])) / length
        if outward @ (one - middle) < 0:
            outward = -outward
        here_met = met[side]
        if here_met.sum() < 4:
            return corners, 0.0
        t = (_ALONG * length).astype(np.float32)
        place, slope = line_through(t[here_met], places[side][here_met], tolerance=0.4)
        near = here_met & (abs(places[side] - place - slope * t) < max(1.0, 0.02 * length))
        good += int(near.sum())
        start = one + place * outward
        lines.append((start, along / length + slope * outward))
    refined = np.array([_meet(lines[side - 1], lines[side]) for side in range(4)])
    if not np.isfinite(refined).all() or abs(refined - corners).max() > 2 * reach:
        return corners, 0.0
    return refined, good / met.size


def _meet(one: tuple[Places, Places], other: tuple[Places, Places]) -> Places:
    """Return where two lines meet, each a place and a direction."""
    (p, u), (q, v) = one, other
    across = u[0] * v[1] - u[1] * v[0]
    if abs(across) < 1e-6:
        return np.array((math.nan, math.nan))
    meet: Places = p + ((q[0] - p[0]) * v[1] - (q[1] - p[1]) * v[0]) / across * u
    return meet


def _sides(grey: "Grey", corners: Places) -> tuple[float, float | None]:
    """Return how much brighter it is around a marker than its border, and the edge's width."""
    reach = max(3.0, 0.1 * float(np.hypot(*(corners[1] - corners[0]))))
    _across, levels = _profiles(grey, corners, reach, 0.25)
    profile = np.median(levels.reshape(-1, levels.shape[2]), axis=0).astype(np.float32)
    quarter = max(1, len(profile) // 5)
    contrast = float(np.median(profile[-quarter:]) - np.median(profile[:quarter]))
    return contrast, edge_width(profile if contrast > 0 else -profile, 0.25)
