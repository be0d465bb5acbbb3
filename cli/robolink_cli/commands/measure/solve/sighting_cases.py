"""What ``solve`` takes of cameras, boards and orientations."""

from collections.abc import Callable, Mapping
from typing import Final

from robolink import calibration as cal
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink_cli.commands.measure.solve.case import (
    EULER,
    Node,
    read_offset,
    read_point,
    read_pose,
    unusable,
)
from robolink_cli.views.solve import result_payload, space_payload

Payload = dict[str, object]


def up_camera(node: Node) -> Payload:
    """One look of a calibrated camera."""
    sighting = _sighting(node)
    known, height = known_tip(node)
    result = cal.solve_up_camera(sighting, stored=known, height=height, sigma_mm=_sigma(node))
    return space_payload(result) | {"r33": cal.FlangePlane.of(sighting.flange).r33}


def camera_affine(node: Node) -> Payload:
    """Pictures of a camera whose place is unknown."""
    seen = [_pixel(child) for child in node.children("observations")]
    before = node.optional("before", lambda name: _camera(node.child(name)))
    known, height = known_tip(node)
    result = cal.solve_camera_affine(
        seen, stored=known, height=height, sigma_mm=_sigma(node), before=before
    )
    camera = result.camera
    return result_payload(result) | {
        "mm_per_px_matrix": [value for row in camera.mm_per_px for value in row],
        "camera_origin": list(camera.origin_mm),
        "mirrored": camera.mirrored,
        "scale_mm_per_px": list(camera.scale_mm_per_px),
        "turn_deg": camera.turn_deg,
        "shear_deg": camera.shear_deg,
        "rms_px": result.rms_px,
    }


def board(node: Node) -> Payload:
    """A held board, from two fiducials."""
    seen = [_fiducial(child) for child in node.children("fiducials")]
    if len(seen) != 2:
        raise unusable(node.at("fiducials"), tr("two fiducials are needed; board_fit takes more"))
    known, height = known_tip(node)
    result = cal.solve_board(
        *seen,
        stored=known,
        height=height,
        spacing_mm=node.optional("spacing_mm", node.number),
        sigma_mm=_sigma(node),
        allow_mixed_hand=True,
    )
    return result_payload(result)


def board_fit(node: Node) -> Payload:
    """A held board, from several fiducials and their drawing."""
    seen, drawing = [], []
    for child in node.children("fiducials"):
        drawing.append(read_point(child.child("drawing")))
        seen.append(_fiducial(child))
    known, height = known_tip(node)
    result = cal.solve_board_fit(
        seen, drawing, stored=known, height=height, sigma_mm=_sigma(node), allow_mixed_hand=True
    )
    return result_payload(result)


def orientation(node: Node) -> Payload:
    """EPSON's U, V, W as a matrix and as CODESYS's A, B, C."""
    _euler(node, "euler_in")
    node.optional("euler_out", lambda name: node.text(name, "R=Rz(A)Ry(B)Rz(C)"))
    matrix = cal.rotation_of(Pose(0, 0, 0, node.number("u"), node.number("v"), node.number("w")))
    return {"rotation_matrix": matrix.ravel().tolist(), "zyz": list(cal.zyz_deg(matrix))}


def _sigma(node: Node) -> float | None:
    return node.optional("sigma_mm", node.number)


def _euler(node: Node, name: str) -> None:
    node.optional(name, lambda key: node.text(key, EULER))


def _sighting(node: Node) -> "cal.Sighting":
    flange, tip = read_pose(node.child("flange")), node.child("tip")
    place = (tip.number("x"), tip.number("y"), tip.optional("z", tip.number))
    tip.finish()
    return cal.Sighting(flange, *place)


def known_tip(node: Node) -> "tuple[ToolOffset | None, cal.TipHeight | None]":
    """Return what is stored of a tip, and its height where that is known.

    A stored offset without Z says nothing about the height; ``stored_z_sigma_mm`` says how sure
    the Z is.
    """
    sigma = node.optional("stored_z_sigma_mm", node.number)
    if "stored" not in node:
        return None, None
    stored = node.child("stored")
    height = cal.TipHeight(stored.number("z"), sigma) if "z" in stored else None
    offset = read_offset(stored)
    # Without a height only X and Y are kept, so that no Z of 0 is taken for one.
    return (None, None) if height is None else (offset, height)


def _fiducial(node: Node) -> "cal.Sighting":
    sighting = _sighting(node)
    node.finish()
    return sighting


def _pixel(node: Node) -> "cal.PixelSighting":
    px, py = node.number("px"), node.number("py")
    return cal.PixelSighting(read_pose(node), px, py)


def _camera(node: Node) -> "cal.CameraModel":
    matrix, origin = node.numbers("mm_per_px_matrix"), node.numbers("camera_origin")
    node.finish()
    if len(matrix) != 4 or len(origin) != 2:
        raise unusable(node.path, tr("the matrix has four numbers, the origin two"))
    a, b, c, d = matrix
    return cal.CameraModel(((a, b), (c, d)), (origin[0], origin[1]))


SEEING_METHODS: Final[Mapping[str, Callable[[Node], Payload]]] = {
    "up_camera_single": up_camera,
    "up_camera_affine": camera_affine,
    "board_two_fiducials": board,
    "board_fit": board_fit,
    "orientation_convert": orientation,
}
"""Methods by the names that the shared cases use."""
