"""Draws what a camera sees: background, tips, board, what stands still, noise.

What belongs to the tool (rough edge, texture, dirt, bevel, a bore off the middle) is drawn in the
tool's own X and Y, so it turns with it. Shading and glare come from lamps that stand still beside
the camera. How blurred each thing is follows from its height above the plane of focus.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from robolink_simulators.cell.camera import LENS_MM
from robolink_simulators.cell.picture_settings import PictureFaults, PictureLook
from robolink_simulators.cell.tip_looks import TipLook
from robolink_simulators.pictures.board_drawing import draw_board
from robolink_simulators.pictures.scene import DrawnScene, Placed, SeenTip
from robolink_simulators.pictures.shading import (
    PIXEL_VARIANCE,
    Grey,
    Patch,
    disc,
    enlarged,
    lay,
    own_coordinates,
    round_edge,
    soft_step,
    textured,
)

_LAMPS: Final = 12
_BACKGROUNDS: Final = 4


class Pencil:
    """Draws the pictures of one camera; the same seed draws the same ones.

    Args:
        seed: Decides the background, the lamps and the noise.
        look: What all pictures are like.
    """

    def __init__(self, seed: int, look: PictureLook) -> None:
        self._seed = seed
        self._look = look
        rng = np.random.default_rng((seed, 1))
        self._lamp_rad = float(rng.uniform(0, math.tau))
        self._shade = float(rng.uniform(0.05, 0.25))
        self._glare_rad = rng.uniform(0, math.tau, 2)

    def draw(self, scene: DrawnScene, faults: PictureFaults, number: int) -> npt.NDArray[np.uint8]:
        """Return a picture, rows by columns.

        Args:
            scene: What is before the camera.
            faults: What is wrong with this one.
            number: Of the picture, from which its noise is drawn.
        """
        look, (width, height) = self._look, scene.size_px
        grey = _background(self._seed, scene.size_px, look.clutter).copy()

        def sigma_px(above_mm: float) -> float:
            return self._sigma_px(scene, above_mm, faults.defocus_mm)

        if scene.board is not None:
            draw_board(grey, scene.board, scene.size_px, sigma_px)
        if not faults.tip_hidden:
            for tip in scene.tips:
                self._tip(grey, tip, scene.size_px, sigma_px)
        self._fleck(grey, scene, faults)
        if faults.exposure != 1.0:
            grey *= np.float32(faults.exposure)
        if look.noise_grey:
            noise = np.random.default_rng((self._seed, 2, number))
            spread = noise.standard_normal((height, width), np.float32)
            spread *= np.float32(look.noise_grey)
            grey += spread
        grey += np.float32(0.5)
        np.clip(grey, 0, 255, out=grey)
        return grey.astype(np.uint8)

    def _sigma_px(self, scene: DrawnScene, above_mm: float, further_mm: float = 0.0) -> float:
        """Return the blur of something at a height; of a point a disc, as wide as an opening.

        A uniform disc scatters by a quarter of its width along each axis.
        """
        off_mm = abs(above_mm) + further_mm
        width_mm = self._look.aperture_mm * off_mm / (LENS_MM + above_mm)
        sigma_px = width_mm * 1000 / scene.um_per_px / 4
        return math.sqrt(self._look.blur_px**2 + sigma_px**2 + PIXEL_VARIANCE)

    def _tip(
        self,
        grey: Grey,
        tip: SeenTip,
        size_px: tuple[int, int],
        sigma_px: Callable[[float], float],
    ) -> None:
        look = tip.look
        for level, (ring, radius_mm) in enumerate(tip.rings):
            shade = look.cone * (0.55 + 0.45 * level / max(1, len(tip.rings) - 1))
            _round(grey, ring, radius_mm, shade, sigma_px(ring.above_mm), size_px)
        face = tip.face
        sigma = sigma_px(face.above_mm)
        reach = (1.3 * look.radius_mm + _most_mm(look)) * face.px_per_mm * 1.05 + 4 * sigma + 2
        patch = Patch.about(face.at_px, reach, size_px)
        if patch is None:
            return
        u, v = own_coordinates(patch, face)
        sigma_mm = sigma / face.px_per_mm
        out = np.hypot(u, v)
        angle = np.arctan2(v, u)
        edge_mm = _edge_mm(look, angle)
        cover = soft_step(
            np.float32(round_edge(look.radius_mm, sigma_mm)) + edge_mm - out, sigma_mm
        )
        part = patch.of(grey)
        lay(part, cover, self._face(look, patch, u, v, sigma_mm))
        if look.bore_mm:
            bore_x, bore_y = look.bore_at_mm
            bore = disc(np.hypot(u - bore_x, v - bore_y), look.bore_mm, sigma_mm)
            lay(part, bore, look.bore)
        for speck in look.dirt:
            x, y = (at * look.radius_mm for at in speck.at)
            spot = disc(np.hypot(u - x, v - y), speck.size * look.radius_mm, 1.5 * sigma_mm)
            lay(part, spot, speck.grey)

    def _face(self, look: TipLook, patch: Patch, u: Grey, v: Grey, sigma_mm: float) -> Grey:
        """Return how bright the face is: by the lamps, by what is worn into it, by its shape."""
        from_middle = np.hypot(patch.x, patch.y) + np.float32(1e-3)
        if not look.bore_mm:  # a full disc has no middle from which its shading could turn
            out = np.hypot(u, v) / np.float32(look.radius_mm)
            from_middle /= np.clip(out, 1e-3, 1)
        toward = patch.x * math.cos(self._lamp_rad) + patch.y * math.sin(self._lamp_rad)
        bright = 1 + np.float32(self._shade) * toward / from_middle
        for glare_rad in self._glare_rad:
            along = patch.x * math.cos(glare_rad) + patch.y * math.sin(glare_rad)
            bright += np.float32(self._look.glare) * np.exp((along / from_middle - 1) * 12)
        if look.texture:
            worn = textured(u / look.radius_mm, v / look.radius_mm, look.texture_seed)
            bright *= 1 + np.float32(look.texture) * worn
        if look.kind == "needle":
            bevel = math.radians(look.bevel_deg)
            along = (u * math.cos(bevel) + v * math.sin(bevel)) / look.radius_mm
            bright *= 1 + np.float32(0.5) * along
            bright += np.float32(0.5) * np.exp(-(((along - 0.4) / 0.2) ** 2))
        if look.step < 1.0:
            step_x, step_y = look.step_at_mm
            inside = np.hypot(u - step_x, v - step_y)
            flat = disc(inside, look.step * look.radius_mm, sigma_mm)
            bright *= look.step_shade + (1 - np.float32(look.step_shade)) * flat
        shown: Grey = np.clip(look.face * bright, 0, 255)
        return shown

    def _fleck(self, grey: Grey, scene: DrawnScene, faults: PictureFaults) -> None:
        """Draw what stands still in the picture, in focus."""
        if faults.fleck == "none":
            return
        radius, toward = faults.fleck_radius_px, math.radians(faults.fleck_toward_deg)
        width, height = scene.size_px
        at = (
            width / 2 + faults.fleck_beside_px * math.cos(toward),
            height / 2 + faults.fleck_beside_px * math.sin(toward),
        )
        patch = Patch.about(at, radius * 1.3 + 8, scene.size_px)
        if patch is None:
            return
        sigma = self._sigma_px(scene, 0.0)
        part, out = patch.of(grey), np.hypot(patch.x, patch.y)
        if faults.fleck == "lamps":
            for lamp in range(_LAMPS):
                way = math.tau * lamp / _LAMPS
                x, y = radius * math.cos(way), radius * math.sin(way)
                lay(part, disc(np.hypot(patch.x - x, patch.y - y), 0.14 * radius, sigma), 220.0)
            return
        lay(part, disc(out, radius, sigma), 180.0)
        if faults.fleck == "tip":
            lay(part, disc(out, 0.5 * radius, sigma), 15.0)
        elif faults.fleck == "ring":
            behind = patch.of(_background(self._seed, scene.size_px, self._look.clutter))
            lay(part, disc(out, 0.85 * radius, sigma), behind)


def _round(
    grey: Grey,
    placed: Placed,
    radius_mm: float,
    brightness: float,
    sigma_px: float,
    size_px: tuple[int, int],
) -> None:
    """Draw a disc."""
    reach = radius_mm * placed.px_per_mm * 1.1 + 4 * sigma_px
    patch = Patch.about(placed.at_px, reach, size_px)
    if patch is not None:
        u, v = own_coordinates(patch, placed)
        lay(
            patch.of(grey),
            disc(np.hypot(u, v), radius_mm, sigma_px / placed.px_per_mm),
            brightness,
        )


def _most_mm(look: TipLook) -> float:
    return look.radius_mm * max(map(abs, look.edge))


def _edge_mm(look: TipLook, angle: Grey) -> Grey:
    """Return by how much the edge is beside the radius at each angle."""
    shares = np.array((*look.edge, look.edge[0]), np.float32)
    place = (angle * np.float32(len(look.edge) / math.tau)) % np.float32(len(look.edge))
    before = np.minimum(place.astype(np.int32), len(look.edge) - 1)
    between = place - before
    share = shares[before] * (1 - between) + shares[before + 1] * between
    beside: Grey = np.float32(look.radius_mm) * share
    return beside


@lru_cache(maxsize=_BACKGROUNDS)
def _background(seed: int, size_px: tuple[int, int], clutter: int) -> Grey:
    """Return what is behind everything: the dark cell above, with blurred things in it."""
    width, height = size_px
    rng = np.random.default_rng((seed, 3))
    slope = np.linspace(-0.5, 0.5, width)[None, :] * rng.uniform(-15, 15)
    grey: Grey = (
        rng.uniform(12, 45) + slope + np.linspace(-0.5, 0.5, height)[:, None] * rng.uniform(-15, 15)
    ).astype(np.float32)
    grey += enlarged(rng.normal(0, rng.uniform(2, 8), (12, 16)).astype(np.float32), size_px)
    for _ in range(clutter):
        at = (rng.uniform(0, width), rng.uniform(0, height))
        sigma, brightness = rng.uniform(4, 12), float(rng.uniform(20, 110))
        if rng.random() < 0.5:
            radius = rng.uniform(20, 140)
            patch = Patch.about(at, radius + 4 * sigma, size_px)
            cover = disc(np.hypot(patch.x, patch.y), radius, sigma) if patch else None
        else:
            half_x, half_y = rng.uniform(10, 125), rng.uniform(10, 100)
            patch = Patch.about(at, max(half_x, half_y) + 4 * sigma, size_px)
            cover = (
                soft_step(np.float32(half_x) - np.abs(patch.x), sigma)
                * soft_step(np.float32(half_y) - np.abs(patch.y), sigma)
                if patch
                else None
            )
        if patch is not None and cover is not None:
            lay(patch.of(grey), cover, brightness)
    grey.flags.writeable = False
    return grey
