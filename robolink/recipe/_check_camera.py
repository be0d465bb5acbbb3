"""Whether a recipe says where the camera is, what its pixels mean, and turns the tool enough."""

from collections.abc import Iterator

from robolink.calibration import MIN_ROTATION_DEG, angle_spread_deg
from robolink.config import Problem
from robolink.messages import tr
from robolink.recipe._draft import Draft
from robolink.recipe._sources import CameraAffineSource, LookingSource


def camera_place(draft: Draft) -> Iterator[Problem]:
    """Check that the station says where tips are brought before the camera."""
    place, source = draft.station, draft.source
    if place is None or not isinstance(source, LookingSource):
        return
    if place.x_mm is None and place.y_mm is None and place.z_mm is None:
        return  # all of it comes from the station's record
    if place.x_mm is None and place.y_mm is None:
        yield Problem(
            "station.x_mm",
            tr('is missing: with kind = "{kind}" it is where the camera looks', kind=source.kind),
        )
    if place.z_mm is None:
        yield Problem(
            "station.z_mm",
            tr('is missing: with kind = "{kind}" it is the height in focus', kind=source.kind),
        )


def camera_pixels(draft: Draft) -> Iterator[Problem]:
    """Check that what a pixel means is said whole, or not at all."""
    source = draft.source
    if not isinstance(source, LookingSource):
        return
    if (source.mm_per_px is None) != (source.origin_mm is None):
        absent = "origin_mm" if source.origin_mm is None else "mm_per_px"
        yield Problem(
            f"source.{absent}", tr("is missing: give mm_per_px and origin_mm, or neither")
        )
    elif source.model is not None and not source.model.determinant:
        yield Problem("source.mm_per_px", tr("maps all pixels onto one line"))


def camera_looks(draft: Draft) -> Iterator[Problem]:
    """Check that several looks turn the tool, and that the lift has room."""
    source, box = draft.source, draft.box
    if not isinstance(source, LookingSource):
        return
    # The corners of the pattern are looked at without a turn.
    corners = (0.0,) if isinstance(source, CameraAffineSource) else ()
    angles_deg = (*corners, *source.turns_deg)
    if len(angles_deg) > 1 and angle_spread_deg(angles_deg) < MIN_ROTATION_DEG:
        yield Problem(
            "source.turns_deg",
            tr("must spread over at least {limit:g} degrees", limit=MIN_ROTATION_DEG),
        )
    if box is not None and source.lift_mm > box.down_mm + box.up_mm:
        yield Problem(
            "source.lift_mm", tr("must be at most the height of the box, down_mm + up_mm")
        )
