"""Cases of ``solve`` with cameras, boards, light beams and orientations."""

from robolink import calibration as cal
from robolink.messages import tr
from robolink.methods import BeamsParameters
from robolink.model import Pose, json_fields
from robolink_cli.commands.measure.solve.case import (
    EULER,
    Node,
    Payload,
    read_offset,
    read_place,
    read_pose,
    read_sighting,
    unusable,
)
from robolink_cli.views.solve import result_payload, space_payload


def up_camera(node: Node) -> Payload:
    """One look of a calibrated camera."""
    sighting = read_sighting(node)
    result = node.call(cal.solve_up_camera, "sigma_mm", sighting=sighting, **_known_tip(node))
    return space_payload(result) | {"r33": cal.FlangePlane.of(sighting.flange).r33}


def camera_affine(node: Node) -> Payload:
    """Pictures of a camera whose place is unknown."""
    seen = node.each("observations", cal.PixelSighting)
    given = {"sightings": seen, **_known_tip(node)}
    result = node.call(cal.solve_camera_affine, "before sigma_mm", **given)
    camera = result.camera
    return result_payload(result) | {
        "mm_per_px_matrix": [value for row in camera.mm_per_px for value in row],
        "camera_origin": list(camera.origin_mm),
        **json_fields(camera, "mirrored", "scale_mm_per_px", "turn_deg", "shear_deg"),
        **json_fields(result, "rms_px"),
    }


def board(node: Node) -> Payload:
    """A held board, from two fiducials."""
    seen = node.each("fiducials", cal.Sighting)
    if len(seen) != 2:
        raise unusable(node.at("fiducials"), tr("expected: two fiducials; board_fit takes more"))
    given = {"first": seen[0], "second": seen[1], "allow_mixed_hand": True, **_known_tip(node)}
    return result_payload(node.call(cal.solve_board, "spacing_mm sigma_mm", **given))


def board_fit(node: Node) -> Payload:
    """A held board, from several fiducials and their drawing."""
    seen, drawing = [], []
    for child in node.children("fiducials"):
        drawing.append(read_place(child.child("drawing"), "xy"))
        seen.append(read_sighting(child))
        child.finish()
    given = {"sightings": seen, "drawing_mm": drawing, **_known_tip(node)}
    return result_payload(
        node.call(cal.solve_board_fit, "sigma_mm", allow_mixed_hand=True, **given)
    )


def crossed_beams(node: Node) -> Payload:
    """Moves through two beams whose places are known."""
    from robolink.methods.beams.crossings import require_straight  # numpy, late

    beams = node.each("beams", cal.Beam)
    if len(beams) != 2:
        raise unusable(node.at("beams"), tr("expected: two beams"))
    given = {"beams": beams, **_known_tip(node)}
    given["beams_may_have_moved"] = bool(node.optional("beams_may_have_moved", node.raw))
    result = node.call(cal.solve_crossed_beams, "crossings sigma_mm shaft step_mm", **given)
    require_straight(result, node.number_or("max_lean_deg", BeamsParameters.max_lean_deg))
    return result_payload(result) | {
        **json_fields(result, "lag_mm"),
        "u_mm": [row[index] ** 0.5 for index, row in enumerate(result.covariance)],
        **json_fields(result, "u_without_beams_mm", "half_width95"),
        **result.details(),
    }


def find_beams(node: Node) -> Payload:
    """Where two beams are, from a pin whose tip is known."""
    beams = node.call(
        cal.find_beams,
        "tip_sigma_mm sigma_mm",
        crossings=node.each("crossings", cal.Crossing),
        tip_mm=read_place(node.child("tip"), "xy"),
    )
    rest = ("direction_deg", "sigma_mm", "direction_sigma_deg", "correlation")
    places = [{"x": beam.x_mm, "y": beam.y_mm, **json_fields(beam, *rest)} for beam in beams]
    return {"beams": places}


def runout(node: Node) -> Payload:
    """A tip seen while the tool turns."""
    sightings = []
    for child in node.children("sightings"):
        flange = read_pose(child.child("flange"))
        sightings.append(cal.Sighting(flange, *read_place(child.child("tip"), "xy")))
        child.finish()
    report = node.call(cal.runout_report, "sigma_mm", sightings=sightings)
    return {
        "codes": list(report.warnings),
        "offset": list(report.tip_mm),
        **json_fields(report, "half_width95_mm"),
        "centre": list(report.centre_mm),
        **json_fields(report, "centre_mm", "runout_mm", "ellipse_mm", "second_mm"),
        **json_fields(report, "amplitude_limit_mm", "distinct_angles", "rank", "rms_mm"),
        **json_fields(report, "peak_mm", "harmonics_matter"),
    }


def orientation(node: Node) -> Payload:
    """EPSON's U, V, W as a matrix and as CODESYS's A, B, C."""
    node.optional("euler_in", lambda name: node.text(name, EULER))
    node.optional("euler_out", lambda name: node.text(name, "R=Rz(A)Ry(B)Rz(C)"))
    matrix = cal.rotation_of(Pose(0, 0, 0, node.number("u"), node.number("v"), node.number("w")))
    return {"rotation_matrix": matrix.ravel().tolist(), "zyz": list(cal.zyz_deg(matrix))}


def _known_tip(node: Node) -> Payload:
    """Return the stored tip, and its height if that is known.

    A stored offset without Z says nothing about the height; ``stored_z_sigma_mm`` says how sure
    the Z is.
    """
    sigma = node.optional("stored_z_sigma_mm", node.number)
    if "stored" not in node:
        return {}
    stored = node.child("stored")
    height = cal.TipHeight(stored.number("z"), sigma) if "z" in stored else None
    offset = read_offset(stored)
    # Without a height only X and Y are kept, so that a Z of 0 is not taken for a height.
    return {} if height is None else {"stored": offset, "height": height}
