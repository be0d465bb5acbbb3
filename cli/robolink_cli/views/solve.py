"""What ``solve`` shows: the names are those of the shared calibration cases."""

from collections.abc import Mapping, Sequence
from typing import Final

from robolink.calibration import Accuracy, CalibrationResult, rows_in_words, stated_mm
from robolink.messages import declared, spoken, tr
from robolink.model import json_fields, json_value
from robolink_cli.console.render import say

SOLVED: Final = "solved"
"""Key of the result, until the statement of its accuracy replaces it."""


def result_payload(result: CalibrationResult) -> dict[str, object]:
    """Return a result as plain values; lengths in mm, angles in degrees.

    The result itself stands under :data:`SOLVED`.
    """
    payload: dict[str, object] = {"codes": list(result.warnings), SOLVED: result}
    lengths = [name for name in ("x_mm", "y_mm", "z_mm") if name in result.measured]
    if "x_mm" in lengths:
        payload["offset"] = [getattr(result.offset, name) for name in lengths]
    else:
        payload |= {name[0]: getattr(result.offset, name) for name in lengths}
    for name in ("u_deg", "v_deg", "w_deg"):
        if name in result.measured:
            payload[name[0]] = getattr(result.offset, name)
    if result.reference_point_mm:
        in_local = any(pose.local for pose in result.inputs)
        where = "reference_point_local" if in_local else "reference_point"
        payload[where] = list(result.reference_point_mm)
    payload |= result.evidence.as_json() if result.evidence is not None else {}
    return payload | {
        **json_fields(result, "notes", "measured", "unobservable", "interval95"),
        "half_width95": list(result.half_width95) or None,
        "interval_from": result.interval_from or None,
        **json_fields(result, "region95_radius_mm", "budget", "covariance", "sigma_mm"),
        **json_fields(result, "sigma_stated", sigma_gain_per_axis="sigma_gain"),
        **json_fields(result, rms_residual="rms_mm", max_residual="max_residual_mm"),
        "residuals": json_value(result.residual_distances_mm),
        **json_fields(result, "rejected", "condition_number", "rank", "dof"),
    }


def space_payload(result: CalibrationResult) -> dict[str, object]:
    """Return a result with X, Y and Z of the offset, measured or kept."""
    return result_payload(result) | {"offset_xyz": list(result.offset.components()[:3])}


def show_case(document: Mapping[str, object]) -> None:
    """Print one solved case."""
    codes = _words(document["codes"])
    name = document.get("id") or document["method"]
    say(f"{name}: {document['status']}" + (f" ({codes})" if codes else ""))
    if document["status"] == "error":
        say(f"  {document['what']}")
        say(f"  {document['remedy']}")
        return
    for key, label in _SHOWN:
        if key in document:
            say(f"  {spoken(label)}: {_values(document[key], _DECIMALS.get(key, 3))}")
    _show_quality(document)


def _show_quality(document: Mapping[str, object]) -> None:
    if "interval95" in document:
        _show_statements(document)
    if document.get("rms_residual") is not None:
        say(
            tr(
                "  residual rms {rms:.4f} mm, largest {worst:.4f} mm, degrees of freedom {dof}",
                rms=document["rms_residual"],
                worst=document["max_residual"],
                dof=document["dof"],
            )
        )
    if document.get("notes"):
        say(tr("  notes: {notes}", notes=_words(document["notes"])))
    if document.get("rejected"):
        say(tr("  rejected poses (from 0): {poses}", poses=_words(document["rejected"])))
    if document.get("unobservable"):
        say(tr("  not measured: {names}", names=_words(document["unobservable"])))


def _show_statements(document: Mapping[str, object]) -> None:
    """Print the repeatability and accuracy of a case, together and each component alone."""
    repeatable, accurate = _repeatable_to_mm(document), document.get("accurate_to_mm")
    if repeatable is not None:
        say(tr("  repeatable to +-{mm} mm (95 %)", mm=stated_mm(repeatable, 4)))
    else:
        say(tr("  repeatable: not known; state sigma_mm, the size of the errors"))
    if isinstance(accurate, float):
        say(tr("  accurate to +-{mm} mm (95 %)", mm=stated_mm(accurate, 4)))
    intervals = document["interval95"]
    if isinstance(intervals, dict):
        for name, (low, high) in intervals.items():
            say(
                tr(
                    "  repeatable alone, 95 %: {name} {middle:.4f} +-{half}",
                    name=name,
                    middle=(low + high) / 2,
                    half=stated_mm((high - low) / 2, 4),
                )
            )
    _show_rows(document.get("accuracy"))
    budget = document.get("budget")
    if isinstance(budget, dict):
        say(
            tr(
                "  standard uncertainty: type A {a:.4f} mm, type B {b:.4f} mm, combined {c:.4f} mm",
                a=budget["type_a_mm"],
                b=budget["type_b_mm"],
                c=budget["u_c_mm"],
            )
        )


def _repeatable_to_mm(document: Mapping[str, object]) -> float | None:
    """Return the repeatability of a case: the region of its lengths, else the worst of them."""
    told = document.get("repeatable_to_mm", document.get("region95_radius_mm"))
    intervals = document["interval95"]
    if isinstance(told, float) or not isinstance(intervals, dict):
        return told if isinstance(told, float) else None
    halves = [(high - low) / 2 for name, (low, high) in intervals.items() if name.endswith("_mm")]
    return max(halves, default=None)


def _show_rows(accuracy: object) -> None:
    """Print the parts of the accuracy statement; nothing without one."""
    if not isinstance(accuracy, dict):
        return
    for row in rows_in_words(Accuracy.from_json(accuracy)):
        half = f" +-{row.half_width}" if row.half_width else ""
        say(
            tr(
                "  row {title}{half}: {basis}, {share:.0f} %",
                title=row.title,
                half=half,
                basis=row.basis,
                share=row.share_percent,
            )
        )


def _values(value: object, decimals: int) -> str:
    if value is None:
        return "-"
    if isinstance(value, list):
        apart = "\n    " if value and isinstance(value[0], dict) else "  "
        return apart.join(_values(item, decimals) for item in value)
    if isinstance(value, dict):
        return "  ".join(f"{key} {_values(item, decimals)}" for key, item in value.items())
    if isinstance(value, bool):
        return tr("yes") if value else tr("no")
    return f"{value:.{decimals}f}" if isinstance(value, float) else str(value)


def _words(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, Sequence) else str(value)


_DECIMALS = {
    "mm_per_px_matrix": 6,
    "rotation_matrix": 6,
    "direction": 5,
    "latency_s": 5,
    "overshoot_s2_per_mm": 6,
}

_SHOWN = (
    ("offset", declared("offset mm")),
    ("z", declared("Z mm")),
    ("u", declared("U deg")),
    ("v", declared("V deg")),
    ("w", declared("W deg")),
    ("reference_point", declared("reference point mm")),
    ("reference_point_local", declared("reference point in its local, mm")),
    ("u_c_mm", declared("combined standard uncertainty mm")),
    ("nu_eff", declared("effective degrees of freedom")),
    ("coverage_factor", declared("coverage factor")),
    ("expanded_mm", declared("expanded uncertainty mm")),
    ("not_assessed", declared("not stated")),
    ("plain_ls_offset", declared("offset without rejecting, mm")),
    ("mm_per_px_matrix", declared("mm per pixel")),
    ("camera_origin", declared("camera origin mm")),
    ("mirrored", declared("mirrored image")),
    ("rotation_matrix", declared("rotation matrix")),
    ("zyz", declared("A, B, C deg")),
    ("lag_mm", declared("lag mm")),
    ("latency_s", declared("latency s")),
    ("overshoot_s2_per_mm", declared("overshoot s^2/mm")),
    ("chain", declared("chain")),
    ("full_calibration_due", declared("full calibration due")),
    ("beams", declared("beams")),
    ("direction", declared("axis direction")),
    ("tilt_deg", declared("tilt deg")),
    ("runout_mm", declared("runout mm")),
    ("ellipse_mm", declared("ellipse mm")),
    ("second_mm", declared("second harmonic mm")),
    ("tools", declared("tools")),
    ("pins", declared("pins mm")),
    ("height_change_mm", declared("change of height mm")),
    ("z_by_difference_mm", declared("Z by difference mm")),
    ("offset_z", declared("Z to write mm")),
    ("common_mm", declared("common shift mm")),
    ("chi_square", declared("chi-square")),
    ("chi_square_limit", declared("chi-square by chance, at most")),
    ("detectable_mm", declared("detectable shift mm")),
    ("u_mm", declared("standard uncertainty mm")),
    ("correlation", declared("correlation")),
    ("u_difference_mm", declared("standard uncertainty of a difference mm")),
    ("max_drift_mm", declared("largest drift mm")),
    ("passed", declared("passed")),
    ("correction_mm", declared("correction mm")),
    ("plane", declared("plane")),
    ("sphere", declared("sphere")),
    ("repeatability_mm", declared("repeatability mm")),
    ("reproducibility_mm", declared("reproducibility mm")),
    ("grr_mm", declared("both together mm")),
    ("part_mm", declared("between nozzles mm")),
    ("percent_of_tolerance", declared("% of the tolerance")),
    ("percent_of_total", declared("% of the whole spread")),
    ("ndc", declared("kinds of nozzle told apart")),
    ("centre", declared("centre mm")),
    ("limits", declared("limits mm")),
    ("points_out", declared("points outside (from 0)")),
    ("ewma_first", declared("drift since point (from 0)")),
    ("poses", declared("poses")),
    ("sigma_gains", declared("gain of sigma after each pose")),
)
"""Fields of a document that are printed, in this order. The others are for programs."""
