"""Solves a case, or a file of them, without any robot."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, cast

from robolink.calibration import AccuracyFacts, CalibrationResult, assessed
from robolink.errors import CalibrationError, ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink.model import json_value
from robolink.pose_tables import ReadingChoices, TabledPose
from robolink.pose_tables import read_poses as tabled_poses
from robolink_cli.commands.measure.solve import (
    lasting_cases,
    pose_cases,
    sighting_cases,
    touch_cases,
)
from robolink_cli.commands.measure.solve.case import (
    Node,
    Payload,
    read_facts,
    read_frames,
    read_poses,
    unusable,
)
from robolink_cli.views.solve import SOLVED

CASE_SCHEMA: Final = "robolink-calibration-vectors/1"
METHODS: Final[Mapping[str, Callable[[Node], Payload]]] = {
    "two_pose": pose_cases.two_pose,
    "two_pose_general": pose_cases.two_pose,
    "n_angle": pose_cases.n_angle,
    "n_angle_robust": pose_cases.n_angle_robust,
    "pivot": pose_cases.pivot,
    "pivot_robust": pose_cases.pivot_robust,
    "uncertainty_budget": pose_cases.uncertainty_budget,
    "up_camera_single": sighting_cases.up_camera,
    "up_camera_affine": sighting_cases.camera_affine,
    "board_two_fiducials": sighting_cases.board,
    "board_fit": sighting_cases.board_fit,
    "orientation_convert": sighting_cases.orientation,
    "needle_change": touch_cases.needle_change,
    "one_touch": touch_cases.one_touch,
    "crossed_beams": sighting_cases.crossed_beams,
    "find_beams": sighting_cases.find_beams,
    "z_touch": touch_cases.z_touch,
    "six_point": pose_cases.six_point,
    "tool_axis": pose_cases.tool_axis,
    "runout": sighting_cases.runout,
    "joint": pose_cases.joint,
    "verify": pose_cases.verify,
    "update_guard": lasting_cases.update_guard,
    "suggest_poses": pose_cases.suggest_poses,
    "length_change": lasting_cases.length_change,
    "station_shift": lasting_cases.station_shift,
    "needle_chain": lasting_cases.needle_chain,
    "station_chain": lasting_cases.station_chain,
    "plane_touch": touch_cases.plane_touch,
    "sphere_touch": touch_cases.sphere_touch,
    "gauge_rr": lasting_cases.gauge_rr,
    "control_chart": lasting_cases.control_chart,
    "touch_evidence": touch_cases.touch_evidence,
    "verify_evidence": touch_cases.verify_evidence,
}
"""Methods by their names in the shared cases."""

_GAINS_OF: Final = ("two_pose", "two_pose_general", "n_angle", "n_angle_robust")
_SEVERITY: Final = ("ok", "warn", "error")
_MOST_BYTES: Final = 64_000_000
"""Largest size of a cases file in bytes, above the limit for other files: it may hold many cases.
"""


def load(path: Path) -> Node:
    """Return the document of a JSON file.

    Raises:
        ConfigError: It cannot be read or is no JSON object.
    """
    import json

    try:
        value = json.loads(read_named(path, most_bytes=_MOST_BYTES).decode("utf-8-sig"))
    except OSError as error:
        cause = error.strerror or str(error)
        raise unusable(str(path), tr("it cannot be read ({error})", error=cause)) from error
    except (ValueError, RecursionError) as error:
        raise unusable(str(path), tr("it is not a JSON file ({error})", error=error)) from error
    return Node(value, "")


def solve_document(node: Node) -> dict[str, object]:
    """Return the answer to one case, or to a file with ``vectors``.

    Raises:
        ConfigError: The file is not laid out as it should be; names the path.
    """
    node.optional("schema", lambda name: node.text(name, CASE_SCHEMA))
    if "vectors" not in node:
        return solve_case(node)
    node.ignore("conventions")
    results = [_answer(value, path) for value, path in node.items("vectors")]
    node.finish()
    worst = max((str(result["status"]) for result in results), key=_SEVERITY.index, default="ok")
    return {"status": worst, "results": results}


def _answer(value: object, path: str) -> dict[str, object]:
    """Return the answer to one of many cases; its errors end no other."""
    named = value if isinstance(value, dict) else {}
    head = {name: named[name] for name in ("id", "method") if isinstance(named.get(name), str)}
    try:
        return solve_case(Node(value, path))
    except ConfigError as error:
        return {
            "method": "",
            **head,
            "status": "error",
            "codes": ["invalid_input"],
            "what": error.what,
            "remedy": error.remedy,
        }


def solve_case(node: Node) -> dict[str, object]:
    """Return the answer to one case; a refusal is an answer too, with status ``error``.

    Raises:
        ConfigError: The case is not laid out as it should be; names the path.
    """
    node.ignore("schema", "expected", "tolerance", "note")
    identity = node.optional("id", node.raw)
    method = node.text("method", *METHODS)
    node.optional("units", lambda name: _check_units(node.child(name)))
    head: dict[str, object] = {} if identity is None else {"id": identity}
    head |= {"method": method}
    facts = node.optional("accuracy", lambda name: read_facts(node.child(name)))
    given = node.child("input")
    node.finish()
    try:
        read_frames(given)
        found = METHODS[method](given)
    except CalibrationError as error:
        return head | _refusal(error, method, given)
    given.finish()
    found = _with_accuracy(found, facts or AccuracyFacts())
    codes = found.pop("codes", [])
    status = found.pop("status", "warn" if codes else "ok")
    plain: dict[str, object] = json_value(found)
    return head | {"status": status, "codes": codes} | plain


def _with_accuracy(found: Mapping[str, object], facts: AccuracyFacts) -> dict[str, object]:
    """Return an answer in which each result, also a nested one, has its accuracy."""
    told: dict[str, object] = {}
    for name, value in found.items():
        if name == SOLVED and isinstance(value, CalibrationResult):
            told |= _statements(value, facts)
        else:
            told[name] = _with_accuracy(value, facts) if isinstance(value, dict) else value
    return told


def _statements(result: CalibrationResult, facts: AccuracyFacts) -> dict[str, object]:
    """Return what a result is repeatable to and accurate to, plain values.

    Args:
        result: The result.
        facts: What the case states of the rows of its budget; the others are defaults.
    """
    accuracy = assessed(result, facts).accuracy
    return {
        "repeatable_to_mm": result.repeatable_to_mm,
        "accurate_to_mm": None if accuracy is None else accuracy.within_mm,
        "accuracy": None if accuracy is None else accuracy.as_json(result.measured),
    }


def _refusal(error: CalibrationError, method: str, given: Node) -> dict[str, object]:
    refusal: dict[str, object] = {
        "status": "error",
        "codes": [error.code, *error.others],
        "what": error.what,
        "remedy": error.remedy,
    }
    if error.code == "insufficient_rotation" and method in _GAINS_OF:
        from robolink.calibration import planar_sigma_gain

        refusal["sigma_gain_per_axis"] = planar_sigma_gain(read_poses(given))
    return refusal


def _check_units(node: Node) -> None:
    node.text("length", "mm")
    node.text("angle", "deg")
    node.finish()


def exit_code(document: Mapping[str, object], *, accept_residuals: bool = False) -> int:
    """Return 7 when a case was refused or its residuals are beyond tolerance, else 0.

    Args:
        document: As :func:`solve_document` returns it.
        accept_residuals: Whether large residuals are no reason.
    """
    from robolink.calibration import beyond_tolerance

    if document["status"] == "error":
        return 7
    results = document.get("results")
    for result in results if isinstance(results, list) else [document]:
        if not accept_residuals and beyond_tolerance(cast("list[str]", result["codes"])):
            return 7
    return 0


def table_case(
    path: Path,
    *,
    method: str,
    choices: ReadingChoices,
    sigma_mm: float | None,
    threshold_mm: float | None,
) -> Node:
    """Return the case of a file of poses.

    Args:
        path: The file (docs/poses.md, "Files of poses").
        method: A method that takes poses on one point.
        choices: What the file does not say.
        sigma_mm: Standard deviation of one placement, if it is known.
        threshold_mm: Residual beyond which a robust method rejects a pose.

    Raises:
        AmbiguousPosesError: The file can be read in more than one way.
        CalibrationError: ``non_finite``; ``tool_pose`` for poses of another tool.
        ConfigError: It cannot be read or is no list of poses.
    """
    entries = tabled_poses(path, choices).entries
    other = next((one.pose.tool for one in entries if one.pose.tool), None)
    if other is not None:
        raise CalibrationError(
            "tool_pose",
            tr("The poses belong to tool {other}, not {tool}.", other=other, tool=0),
            remedy=tr(
                "Record them with the flange, Tool 0; offline, the values of other "
                "tools are not known."
            ),
        )
    given: dict[str, object] = {"poses": [_as_case(one) for one in entries], "as_taught": True}
    given |= {} if sigma_mm is None else {"sigma_mm": sigma_mm}
    given |= {} if threshold_mm is None else {"inlier_threshold": threshold_mm}
    return Node({"id": path.name, "method": method, "input": given}, "")


def _as_case(entry: TabledPose) -> dict[str, object]:
    pose = entry.pose
    case: dict[str, object] = dict(zip("xyzuvw", pose.coordinates(), strict=True))
    case["local"] = pose.local
    case |= {} if pose.hand is None else {"hand": str(pose.hand)}
    return case if pose.tool is None else {**case, "tool": pose.tool}
