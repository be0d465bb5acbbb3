"""Why nothing in a picture was taken for what was looked for, in words."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from robolink.errors import CalibrationError
from robolink.eye.candidate import Candidate, RefusalCode
from robolink.messages import tr
from robolink.model import TIP

if TYPE_CHECKING:
    from robolink.eye.picture import CameraPicture, Grey

__all__ = ["light_refusal", "miss"]

DARK_LEVEL: Final = 24
"""Grey level, of 255, that less than one pixel in 200 exceeds in a dark picture."""

BRIGHT_LEVEL: Final = 250
"""Grey level from which a pixel counts as white."""

BRIGHT_SHARE: Final = 0.3
"""Share of white pixels from which a picture counts as overexposed."""

_BRIGHTEST: Final = 99.5
"""Percentile: one pixel in 200 may be a hot pixel or a reflection."""

_OUT_OF_FOCUS: Final = frozenset({RefusalCode.BLURRED, RefusalCode.FAINT_EDGE})
"""What is wrong with a tip that is out of focus; all else would have to be right."""


def miss(
    picture: "CameraPicture", candidates: Sequence[Candidate], camera: str, *, mark: int = TIP
) -> CalibrationError | None:
    """Return why nothing was found in a picture, ``None`` for no known reason.

    Args:
        picture: The picture.
        candidates: All that was looked at in it, none of it accepted.
        camera: Which camera took it.
        mark: What was looked for: the tip, or a fiducial by its number.
    """
    for candidate in sorted(candidates, key=lambda one: -one.score):
        codes = {refusal.code for refusal in candidate.refused}
        if RefusalCode.BLURRED in codes and codes <= _OUT_OF_FOCUS:
            return _out_of_focus(candidate, mark)
        if RefusalCode.CUT in codes:
            return _cut(candidate, mark)
    return light_refusal(picture.grey, camera)


def _out_of_focus(candidate: Candidate, mark: int) -> CalibrationError:
    (blurred,) = (one for one in candidate.refused if one.code is RefusalCode.BLURRED)
    if mark == TIP:
        return CalibrationError(
            "out_of_focus",
            tr(
                "The tip is out of focus: its edge is {edge:.1f} px wide, limit {limit:.1f} px.",
                edge=blurred.measured,
                limit=blurred.limit,
            ),
            remedy=tr(
                "Check the length of the tip (Z), the height of the station and the lens; "
                "'robolink eye look' shows the focus."
            ),
        )
    return CalibrationError(
        "out_of_focus",
        tr(
            "Fiducial {mark} is out of focus: its edge is {edge:.1f} px wide, limit {limit:.1f} "
            "px.",
            mark=mark,
            edge=blurred.measured,
            limit=blurred.limit,
        ),
        remedy=tr("Check how high the board is held, the height of the station and the lens."),
    )


def _cut(candidate: Candidate, mark: int) -> CalibrationError:
    place = {"x": candidate.x_px, "y": candidate.y_px, "radius": candidate.radius_px}
    if mark == TIP:
        return CalibrationError(
            "tip_cut",
            tr(
                "The tip is not wholly in the picture: it is at ({x:.0f}, {y:.0f}), radius "
                "{radius:.0f} px.",
                **place,
            ),
            remedy=tr(
                "Check where the camera looks, and the stored offset of the tool; use a larger "
                "field of view."
            ),
        )
    return CalibrationError(
        "tip_cut",
        tr(
            "Fiducial {mark} is not wholly in the picture: it is at ({x:.0f}, {y:.0f}), radius "
            "{radius:.0f} px.",
            mark=mark,
            **place,
        ),
        remedy=tr(
            "Check where the camera looks, the drawing, and that the board is held as drawn; use a "
            "larger field of view."
        ),
    )


def light_refusal(grey: "Grey", camera: str) -> CalibrationError | None:
    """Return why nothing can be found in a picture, ``None`` where its light is not the reason.

    It is asked only after nothing was found: a picture that looks dark or bright as a whole, and
    shows a tip well, is a good one.

    Args:
        grey: The picture.
        camera: Which camera took it, for the message.

    Example:
        >>> import numpy
        >>> from robolink.eye.misses import light_refusal
        >>> light_refusal(numpy.full((20, 20), 9, numpy.uint8), "camera").code
        'picture_dark'
    """
    import numpy as np

    level = float(np.percentile(grey, _BRIGHTEST))
    if level <= DARK_LEVEL:
        return CalibrationError(
            "picture_dark",
            tr(
                "The picture of {camera} is dark: hardly a pixel is above {level:.0f} of 255.",
                camera=camera,
                level=level,
            ),
            remedy=tr("Switch on the light, open the aperture or expose for longer."),
        )
    share = float(np.mean(grey >= BRIGHT_LEVEL))
    if share >= BRIGHT_SHARE:
        return CalibrationError(
            "picture_overexposed",
            tr(
                "The picture of {camera} is overexposed: {share:.0f} % of it is white.",
                camera=camera,
                share=100 * share,
            ),
            remedy=tr("Expose for a shorter time, close the aperture or dim the light."),
        )
    return None
