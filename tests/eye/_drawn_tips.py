"""Small pictures of one tip, with numpy alone: a bright face with a dark bore, and noise."""

import numpy as np

SIZE_PX = (320, 240)


def drawn_tip(x_px=160.0, y_px=120.0, radius_px=22.0, *, blur_px=0.8, bore=0.45, seed=1):
    """Return a picture; a radius of 0 leaves the tip out."""
    width, height = SIZE_PX
    y, x = np.mgrid[0:height, 0:width]
    away = np.hypot(x - x_px, y - y_px)

    def inside(radius):
        return 1 / (1 + np.exp((away - radius) / (0.45 * blur_px)))

    grey = 35 + 5 * np.sin(x / 37) + 4 * np.cos(y / 23)
    if radius_px:
        grey += 150 * inside(radius_px) - 140 * inside(bore * radius_px)
    noise = np.random.default_rng(seed).normal(0, 2, grey.shape)
    return (grey + noise).clip(0, 255).astype(np.uint8)
