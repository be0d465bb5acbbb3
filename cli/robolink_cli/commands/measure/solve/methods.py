"""What each method of ``solve`` takes, and which solver it calls."""

from collections.abc import Callable, Mapping
from typing import Final

from robolink import calibration as cal
from robolink.calibration import CalibrationResult
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink_cli.commands.measure.solve.case import (
    EULER,
    Node,
    read_offset,
    read_point,
    read_pose,
    read_poses,
    unusable,
)
from robolink_cli.views.solve import result_payload, space_payload

Payload = dict[str, object]


def two_pose(node: Node) -> Payload:
    """Two flange poses on one point."""
    poses = read_poses(node)
    least = _least_rotation(node)
    sigma = _sigma(node)
    if len(poses) > 2:
        raise unusable(node.at("poses"), tr("two poses are wanted; n_angle takes more"))
    if len(poses) < 2:
        return _planar(poses, sigma_mm=sigma)
    result = cal.solve_two_pose(
        *poses, allow_mixed_hand=True, sigma_mm=sigma, min_rotation_deg=least
    )
    return result_payload(result)


def n_angle(node: Node) -> Payload:
    """Several flange poses of four axes on one point."""
    node.ignore("nan_fields")
    least = _least_rotation(node)
    return _planar(read_poses(node), sigma_mm=_sigma(node), min_rotation_deg=least)


def n_angle_robust(node: Node) -> Payload:
    """The same, with a search for outliers."""
    robust, sigma, poses = _robust(node), _sigma(node), read_poses(node)
    found = _planar(poses, sigma_mm=sigma, robust=robust)
    return found | {"plain_ls_offset": _planar(poses, sigma_mm=sigma)["offset"]}


def pivot(node: Node) -> Payload:
    """Flange poses of six axes on one point."""
    _euler(node, "euler")
    result = cal.solve_pivot(read_poses(node), sigma_mm=_sigma(node), allow_mixed_hand=True)
    return result_payload(result)


def pivot_robust(node: Node) -> Payload:
    """The same, with a search for outliers."""
    _euler(node, "euler")
    robust, sigma, poses = _robust(node), _sigma(node), read_poses(node)
    found = cal.solve_pivot(poses, sigma_mm=sigma, robust=robust, allow_mixed_hand=True)
    plain = cal.solve_pivot(poses, sigma_mm=sigma, allow_mixed_hand=True)
    return result_payload(found) | {"plain_ls_offset": list(plain.offset.components()[:3])}


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
        raise unusable(node.at("fiducials"), tr("two fiducials are wanted; board_fit takes more"))
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


def _planar(poses: list[Pose], **options: object) -> Payload:
    result: CalibrationResult = cal.solve_n_angle(
        poses,
        allow_mixed_hand=True,
        **options,  # type: ignore[arg-type]
    )
    return result_payload(result)


def _least_rotation(node: Node) -> float:
    return node.number_or("min_delta_u_deg", cal.MIN_ROTATION_DEG)


def _sigma(node: Node) -> float | None:
    return node.optional("sigma_mm", node.number)


def _robust(node: Node) -> "cal.Robust":
    threshold = node.optional("inlier_threshold", node.number)
    seed = node.optional("seed", node.whole)
    return cal.Robust(threshold, seed=1 if seed is None else seed)


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


FROM_POSES: Final[Mapping[str, Callable[[Node], Payload]]] = {
    "two_pose": two_pose,
    "two_pose_general": two_pose,
    "n_angle": n_angle,
    "n_angle_robust": n_angle_robust,
    "pivot": pivot,
    "pivot_robust": pivot_robust,
    "up_camera_single": up_camera,
    "up_camera_affine": camera_affine,
    "board_two_fiducials": board,
    "board_fit": board_fit,
    "orientation_convert": orientation,
}
"""Methods by the names that the shared cases use."""
