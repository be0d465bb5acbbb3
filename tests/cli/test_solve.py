"""solve: offline, from a file; every refusal is named, every slip has its path."""

import json
from typing import Any

import numpy as np
import pytest
from robolink_cli import main
from robolink_cli.commands.measure.solve.answer import METHODS

from robolink.calibration import Beam
from robolink.model import rotate_xy
from tests.calibration._simulated import pivoting
from tests.calibration.test_surface_touches import on_plane, on_sphere

UNITS = {"length": "mm", "angle": "deg"}
PIN = (310.0, 95.0)


def on_pin(u, tip=(12.5, -3.25), **more):
    dx, dy = rotate_xy(tip[0], tip[1], u)
    return {"x": PIN[0] - dx, "y": PIN[1] - dy, "u": u, **more}


def touching(surface):
    """Return poses of a tip at (12, -5, 120) on a surface."""
    poses = surface(np.random.default_rng(1))
    return [dict(zip("xyzuvw", pose.coordinates(), strict=True)) for pose in poses]


ROUND = [on_pin(u) for u in (0, 90, 180, 270)]
PIVOT = [
    {"x": 345.8, "y": -112.1, "z": -46.6, "u": 0, "v": 0, "w": 0},
    {
        "x": 332.6660782308561,
        "y": -148.24130202639898,
        "z": -42.6737013482217,
        "u": 40,
        "v": 12,
        "w": -8,
    },
    {
        "x": 387.1280247560101,
        "y": -140.21040051010783,
        "z": -39.946626560856515,
        "u": -75,
        "v": -15,
        "w": 10,
    },
    {
        "x": 316.12675035835235,
        "y": -166.19665573493532,
        "z": -33.81532711574917,
        "u": 120,
        "v": 9,
        "w": 20,
    },
]


def case(method="two_pose", **given):
    given = given or {"poses": [ROUND[0], ROUND[2]]}
    return {"method": method, "units": UNITS, "input": given}


@pytest.fixture
def solved(tmp_path, capsys):
    """Run ``solve --json`` on a document; return exit code and JSON."""

    def run(document, *more, text=None):
        path = tmp_path / "case.json"
        path.write_text(text if text is not None else json.dumps(document))
        code = main.run(["solve", str(path), *more, "--json"])
        return code, json.loads(capsys.readouterr().out)

    return run


def test_a_case_is_answered_with_the_names_of_the_shared_cases(solved):
    code, answer = solved(case())
    assert code == 0
    assert (answer["schema"], answer["status"], answer["codes"]) == ("robolink/solve/1", "ok", [])
    assert answer["offset"] == pytest.approx([12.5, -3.25])
    assert answer["reference_point"] == pytest.approx(PIN)
    assert answer["interval95"] == {}


def test_a_person_reads_lines(tmp_path, capsys):
    path = tmp_path / "case.json"
    path.write_text(json.dumps(case(poses=[ROUND[0], ROUND[2]], sigma_mm=0.02)))
    assert main.run(["solve", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "two_pose: ok" in shown
    assert "offset mm: 12.500  -3.250" in shown
    assert "repeatable alone, 95 %: x_mm 12.5000 +-0.0277" in shown
    assert "type B 0.0141 mm" in shown
    assert "not measured: z_mm" in shown


def test_without_an_interval_a_person_is_told_what_is_missing(tmp_path, capsys):
    path = tmp_path / "case.json"
    path.write_text(json.dumps(case()))
    main.run(["solve", str(path)])
    assert "state sigma_mm" in capsys.readouterr().out


def test_two_hands_warn_with_the_number(solved):
    poses = [on_pin(0, hand="right"), on_pin(180, hand="left")]
    code, answer = solved(case(poses=poses))
    assert (code, answer["status"], answer["codes"]) == (0, "warn", ["mixed_hand"])
    assert answer["offset"] == pytest.approx([12.5, -3.25])


def test_what_is_wrong_with_a_case_is_said_before_what_to_do(tmp_path, capsys):
    path = tmp_path / "case.json"
    path.write_text(json.dumps(case(poses=[ROUND[0], ROUND[0]])))
    assert main.run(["solve", str(path), "--json"]) == 7
    answer = json.loads(capsys.readouterr().out)
    assert main.run(["solve", str(path)]) == 7
    said = capsys.readouterr().out
    assert said.index(answer["what"]) < said.index(answer["remedy"])


def test_a_file_with_several_cases_is_as_bad_as_its_worst(solved):
    cases = [{"id": "good", **case()}, {"id": "bad", **case(poses=[ROUND[0], ROUND[0]])}]
    code, answer = solved({"schema": "robolink-calibration-vectors/1", "vectors": cases})
    assert (code, answer["status"]) == (7, "error")
    assert [result["id"] for result in answer["results"]] == ["good", "bad"]
    assert answer["results"][1]["codes"] == ["degenerate_angles"]


def tips(*points):
    return [{"flange": {"x": 300, "y": 50, "u": 0}, "tip": {"x": x, "y": y}} for x, y in points]


def radians(pose):
    return {**pose, "u": pose["u"] * 3.141592653589793 / 180}


REFUSED = {
    "too_few_poses": case(poses=ROUND[:1]),
    "degenerate_angles": case("n_angle", poses=[on_pin(0), on_pin(360), on_pin(-360)]),
    "insufficient_rotation": case("n_angle", poses=[on_pin(0), on_pin(9), on_pin(20)]),
    "rank_deficient": case("pivot", poses=[{**p, "v": 0, "w": 0} for p in PIVOT]),
    "non_finite": case("n_angle", poses=[{**ROUND[0], "x": None}, *ROUND[1:]]),
    "suspect_units": case(
        "n_angle", poses=[{"x": p["x"] / 1e3, "y": p["y"] / 1e3, "u": p["u"]} for p in ROUND]
    ),
    "mixed_local": case("n_angle", poses=[{**ROUND[0], "local": 1}, *ROUND[1:]]),
    "mixed_tool": case("n_angle", poses=[{**p, "tool": k} for k, p in enumerate(ROUND)]),
    "too_many_outliers": case(
        "n_angle_robust",
        poses=[{**on_pin(45 * k), "x": on_pin(45 * k)["x"] + 30 * k * (k < 4)} for k in range(8)],
        inlier_threshold=0.1,
    ),
    "coincident_fiducials": case("board_two_fiducials", fiducials=tips((310, 50), (312, 50))),
    "spacing_mismatch": case(
        "board_two_fiducials", fiducials=tips((310, 50), (350, 50)), spacing_mm=42
    ),
    "implausible_change": case("update_guard", new={"x": 15}, stored={"x": 12}),
    "diverging": case("update_guard", new={"x": 13}, stored={"x": 12}, earlier_mm=[0.5]),
    "implausible_offset": case(
        "two_pose", poses=[on_pin(0, tip=(1200, 0)), on_pin(180, tip=(1200, 0))]
    ),
    "mixed_hand": case(
        "verify",
        poses=[
            {**p, "hand": hand} for p, hand in zip(ROUND, ("left", *["right"] * 3), strict=True)
        ],
        offset={"x": 12.5, "y": -3.25},
    ),
}


FURTHER_GROUNDS = {
    "mixed_tool": ("tool_pose",),
    "mixed_local": ("local_pose",),
    "implausible_offset": ("suspect_units",),
}


@pytest.mark.parametrize("code", REFUSED)
def test_bad_input_ends_with_7_and_its_code(solved, code):
    exit_code, answer = solved(REFUSED[code])
    assert (exit_code, answer["status"]) == (7, "error")
    assert answer["codes"] == [code, *FURTHER_GROUNDS.get(code, ())]
    assert answer["what"]
    assert answer["remedy"]
    assert "offset" not in answer


@pytest.mark.fault("F39")
def test_f39_angles_in_radians_are_suspected(solved):
    _, answer = solved(case("n_angle", poses=[radians(p) for p in ROUND]))
    assert answer["codes"] == ["suspect_units"]


def test_a_changed_camera_is_refused(solved):
    seen = [
        {"x": 300 + dx, "y": 40 + dy, "u": u, "px": 80 * dx, "py": -80 * dy}
        for dx, dy, u in ((0, 0, 0), (2, 0, 0), (0, 2, 0), (1, 1, 180), (2, 1, 90))
    ]
    before = {"mm_per_px_matrix": [0.0125, 0, 0, 0.0125], "camera_origin": [300, 40]}
    code, answer = solved(case("up_camera_affine", observations=seen, before=before))
    assert (code, answer["codes"]) == (7, ["camera_changed"])


@pytest.mark.parametrize(
    "bad", ["null", "NaN", "Infinity", '"12"', "true", "1e999", "1" + "0" * 400]
)
def test_what_is_no_number_is_named_by_its_path(solved, bad):
    text = json.dumps(case(poses=[{**ROUND[0], "y": 77.5}, ROUND[2]])).replace("77.5", bad)
    code, answer = solved(None, text=text)
    assert (code, answer["codes"]) == (7, ["non_finite"])
    assert "input.poses[0].y" in answer["what"]


SLIPS = {
    "method": {**case(), "method": "three_pose"},
    "units.length": {**case(), "units": {**UNITS, "length": "m"}},
    "input.poses[1].q": case(poses=[ROUND[0], {**ROUND[2], "q": 1}]),
    "input.poses[0].x": case(poses=[{"y": 1, "u": 2}, ROUND[2]]),
    "input.poses[1].hand": case(poses=[ROUND[0], {**ROUND[2], "hand": "both"}]),
    "input.poses[0].local": case(poses=[{**ROUND[0], "local": 0.5}, ROUND[2]]),
    "input.poses[1]": case(poses=[ROUND[0], 7]),
    "input.poses": case(poses={"x": 1}),
    "input.speling": case(poses=[ROUND[0], ROUND[2]], speling=1),
    "input": {"method": "two_pose", "input": []},
    "extra": {**case(), "extra": 1},
    "schema": {**case(), "schema": "something/9"},
    "input.euler": case("pivot", poses=PIVOT, euler="XYZ"),
    "input.fiducials": case("board_two_fiducials", fiducials=tips((310, 50))),
    "input.before.mm_per_px_matrix": case(
        "up_camera_affine",
        observations=[{**at, "px": 640, "py": 512} for at in ROUND],
        before={"mm_per_px_matrix": [0, 0, 0, 0.0125], "camera_origin": [0, 0]},
    ),
}


@pytest.mark.parametrize("path", SLIPS)
def test_a_slip_is_a_usage_error_that_names_its_path(solved, path):
    code, answer = solved(SLIPS[path])
    assert code == 2
    assert answer["error"]["what"].startswith(f"{path}: ")


@pytest.mark.parametrize("text", ["", "[1]", "{", '{"method": "two_pose"}'])
def test_what_is_no_case_is_a_usage_error(solved, text):
    code, answer = solved(None, text=text)
    assert (code, answer["schema"]) == (2, "robolink/error/1")


def test_a_missing_file_is_a_usage_error(capsys, tmp_path):
    assert main.run(["solve", str(tmp_path / "none.json")]) == 2
    assert "none.json" in capsys.readouterr().err


def test_a_case_that_is_no_case_is_refused_alone(solved):
    good = case("n_angle", poses=ROUND)
    bad = [{"id": "odd", "method": "x", "input": {}}, 7, {**good, "input": {"poses": [7]}}]
    code, answer = solved({"vectors": [good, *bad, good]})
    assert code == 7
    assert [result["status"] for result in answer["results"]] == ["ok", *["error"] * 3, "ok"]
    assert {tuple(result["codes"]) for result in answer["results"][1:4]} == {("invalid_input",)}
    assert answer["results"][1]["id"] == "odd"
    assert "vectors[3].input.poses[0]" not in answer["results"][1]["what"]
    assert "input.poses[0]" in answer["results"][3]["what"]


def test_residuals_beyond_tolerance_end_with_7_unless_they_are_accepted(solved):
    poses = [{**ROUND[0], "x": ROUND[0]["x"] + 0.6}, *ROUND[1:]]
    code, answer = solved(case("n_angle", poses=poses))
    assert (code, answer["status"]) == (7, "warn")
    assert {"large_rms", "large_residual"} & set(answer["codes"])
    assert solved(case("n_angle", poses=poses), "--accept-residuals")[0] == 0
    assert solved({"vectors": [case("n_angle", poses=poses)]})[0] == 7


def crossings(tip):
    beams, found = (Beam(300, 80, 0), Beam(300, 80, 90)), []
    for number, beam in enumerate(beams):
        nx, ny = beam.normal
        for way in (1, -1):
            ends = [
                {"x": 300 + way * half * nx - tip[0], "y": 80 + way * half * ny - tip[1], "u": 0}
                for half in (-1, 1)
            ]
            found.append({"beam": number + 1, "entry": ends[0], "exit": ends[1]})
    return found


BEAMS = [{"x": 300, "y": 80, "direction_deg": angle} for angle in (0, 90)]
TILTS = (
    *((0, 0, 0), (40, 12, -8), (-75, -15, 10), (120, 9, 20)),
    *((-160, -18, -14), (80, 20, 5), (20, -10, 16)),
)
START = PIVOT[3]
TIP = {"x": 12.5, "y": -3.25}
MORE: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "needle_change": (
        {
            "flange": on_pin(0),
            "before": {"x": 310, "y": 95},
            "after": {"x": 310.2, "y": 95},
            "stored": {"x": 12.5, "y": -3.25, "z": -20},
            "chain": {"sigma_mm": 0.01, "changes": 1},
            "sigma_mm": 0.01,
        },
        {"offset": [12.7, -3.25]},
    ),
    "one_touch": (
        {"flange": {**on_pin(30), "z": 10}, "pin": {"x": 310, "y": 95, "z": -10}},
        {"offset": [12.5, -3.25, -20]},
    ),
    "crossed_beams": (
        {"beams": BEAMS, "crossings": crossings((12.5, -3.25)), "sigma_mm": 0.01},
        {"offset": [12.5, -3.25], "lag_mm": [0, 0]},
    ),
    "z_touch": (
        {
            "touches": [{"z": -29.99, "speed_mm_s": 2}, {"z": -30.02, "speed_mm_s": 8}],
            "surface_z": -50,
        },
        {"z": -50 + 29.98, "latency_s": 0.005},
    ),
    "six_point": (
        {
            "pivot_poses": PIVOT,
            "second_is": "xz",
            "along_x": {**START, "x": START["x"] + 50},
            "second": {**START, "z": START["z"] + 50},
        },
        {"offset": [4.2, -7.9, 131.6]},
    ),
    "tool_axis": (
        {"first": ROUND[0], "second": {**ROUND[0], "z": 20}, "sigma_mm": 0.02},
        {"direction": [0, 0, 1], "tilt_deg": 0},
    ),
    "runout": (
        {"sightings": [{"flange": p, "tip": {"x": PIN[0], "y": PIN[1]}} for p in ROUND]},
        {"offset": [12.5, -3.25], "centre_mm": [0, 0]},
    ),
    "length_change": (
        {"before_z": [-60.0, -60.02], "after_z": [-60.01], "stored_z": -20, "sigma_z_mm": 0.02},
        {"height_change_mm": 0, "limit_mm": 0.1, "offset_z": -20},
    ),
    "station_shift": (
        {
            "shifts": [{"tool": 1, "vector": [0.03, 0.04], "touch_sigma_mm": 0.05}],
            "tolerance_mm": 0.5,
        },
        {"chi_square": 0.5, "common_mm": [0.03, 0.04]},
    ),
    "needle_chain": (
        {"u0_mm": 0.02, "sigma_mm": 0.01, "changes": 6, "reference": "both_touched"},
        {"u_mm": 0.04},
    ),
    "station_chain": (
        {"u_station_mm": 0.03, "sigma_mm": 0.01, "tools": [1, 2, 3]},
        {"correlation": 0.9},
    ),
    "plane_touch": ({"poses": touching(on_plane)}, {"offset": [12, -5, 120]}),
    "sphere_touch": (
        {"poses": touching(on_sphere), "radius_mm": 12.7},
        {"offset": [12, -5, 120], "reference_point": [400, 50, -80]},
    ),
    "gauge_rr": (
        {
            "values": [[[1.0, 1.2], [1.0, 1.2]], [[4.0, 4.2], [4.0, 4.2]]],
            "axes": ["nozzle", "person", "repeat"],
        },
        {"interaction_p": 1, "reproducibility_mm": 0, "repeatability_mm": 0.1264911064067352},
    ),
    "control_chart": (
        {"baseline": [1, 2] * 12, "values": [1, 2]},
        {"centre": 1.5, "limits": [1.5 - 3 / 1.128, 1.5 + 3 / 1.128]},
    ),
    "verify": ({"poses": ROUND, "offset": TIP}, {"max_drift_mm": 0, "passed": True}),
    "update_guard": ({"new": {"x": 12.5}, "stored": {"x": 12.2}}, {"correction_mm": 0.3}),
    "suggest_poses": (
        {
            "count": 2,
            "guess": TIP,
            "point": {"x": 310, "y": 95, "z": 0},
            "u_min_deg": -90,
            "u_max_deg": 90,
        },
        {"sigma_gains": [None, 0.7071067811865476]},
    ),
    "up_camera_single": (
        {"flange": on_pin(30), "tip": {"x": 310, "y": 95}},
        {"offset": [12.5, -3.25]},
    ),
    "n_angle": ({"poses": ROUND}, {"offset": [12.5, -3.25], "dof": 4}),
    "pivot_robust": (
        {
            "poses": [
                dict(zip("xyzuvw", pivoting((4.2, -7.9, 131.6), angles).coordinates(), strict=True))
                for angles in TILTS
            ]
        },
        {"offset": [4.2, -7.9, 131.6], "plain_ls_offset": [4.2, -7.9, 131.6]},
    ),
}


@pytest.mark.parametrize("method", MORE)
def test_every_method_answers_a_plain_case(solved, method):
    given, expected = MORE[method]
    code, answer = solved(case(method, **given))
    assert code == 0, answer
    for key, value in expected.items():
        assert answer[key] == pytest.approx(value, abs=1e-9), key


def test_a_last_touch_takes_the_place_of_a_pin(solved):
    last = {"flange": {**on_pin(30), "z": 10}, "offset": {"x": 12.5, "y": -3.25, "z": -20}}
    flange = {**on_pin(30, tip=(12.8, -3.25)), "z": 10.5}
    _, answer = solved(case("one_touch", flange=flange, last=last))
    assert answer["offset"] == pytest.approx([12.8, -3.25, -20.5])


def test_beams_are_found_and_printed(solved):
    given = []
    for number, (nx, ny) in enumerate(((0, 1), (1, 0)), start=1):
        for along in (-10, -4, 4, 10):
            x, y = 300 + along * ny, 80 + along * nx
            given.append(
                {
                    "beam": number,
                    "entry": {"x": x - nx, "y": y - ny, "u": 0},
                    "exit": {"x": x + nx, "y": y + ny, "u": 0},
                }
            )
    _, answer = solved(case("find_beams", crossings=given, tip={"x": 0, "y": 0}))
    assert [beam["direction_deg"] % 180 for beam in answer["beams"]] == pytest.approx([0, 90])


def test_a_needle_that_leans_is_solved_where_its_end_is(solved):
    def seen(deeper_x):
        at = {"crossings": crossings((deeper_x, -3.25)), "above_mm": 1.5, "deeper_mm": 3}
        tip = crossings((12.53, -3.25))
        return case("crossed_beams", beams=BEAMS, crossings=tip, shaft=at, sigma_mm=0.002)

    code, answer = solved(seen(12.59))
    assert code == 0
    assert answer["offset"] == pytest.approx([12.5, -3.25])
    assert answer["needle"]["lean_deg"] == pytest.approx(1.146, abs=0.001)
    assert answer["needle"]["corrected_mm"] == pytest.approx([-0.03, 0.0])
    code, answer = solved(seen(12.66))
    assert (code, answer["codes"]) == (7, ["bent_needle"])


def test_tools_on_one_pin_are_answered_by_number(solved):
    touches = [{"flange": p, "tool": 1} for p in ROUND]
    touches.append({"flange": on_pin(45, tip=(1, 2)), "tool": 4})
    _, answer = solved(case("joint", touches=touches))
    assert answer["tools"]["4"]["offset"] == pytest.approx([1, 2])
    assert answer["pins"]["0"] == pytest.approx(PIN)


def test_fiducials_and_their_drawing_are_fitted(solved):
    marks = tips((310, 50), (350, 50), (350, 80))
    for mark, (x, y) in zip(marks, ((0, 0), (40, 0), (40, 30)), strict=True):
        mark["drawing"] = {"x": x, "y": y}
    _, answer = solved(case("board_fit", fiducials=marks))
    assert answer["offset"] == pytest.approx([10, 0])
    assert answer["u"] == pytest.approx(0)


def test_a_pose_plan_stays_inside_the_workspace_and_says_what_each_pose_brings(solved):
    asked = {**MORE["suggest_poses"][0], "count": 4}
    free = solved(case("suggest_poses", **asked))[1]
    boxed = solved(case("suggest_poses", **asked, box={"y_max_mm": 95.0}))[1]
    assert max(pose["y"] for pose in free["poses"]) > 95 >= max(p["y"] for p in boxed["poses"])
    assert boxed["sigma_gains"][-1] > free["sigma_gains"][-1]
    code, answer = solved(case("suggest_poses", **asked, box={"y_max": 95.0}))
    assert code == 2
    assert "y_max" in answer["error"]["what"]


def test_a_drift_beyond_the_tolerance_is_a_warning(solved):
    _, answer = solved(case("verify", poses=ROUND, offset={"x": 13, "y": -3.25}))
    assert (answer["status"], answer["codes"], answer["passed"]) == ("warn", ["large_drift"], False)


@pytest.mark.parametrize("method", MORE)
def test_every_answer_can_be_shown_to_a_person(method, tmp_path, capsys):
    path = tmp_path / "case.json"
    path.write_text(json.dumps({"id": "the case", **case(method, **MORE[method][0])}))
    assert main.run(["solve", str(path)]) == 0
    assert capsys.readouterr().out.startswith("the case: ")


def test_a_refusal_is_shown_to_a_person(tmp_path, capsys):
    path = tmp_path / "case.json"
    path.write_text(json.dumps(REFUSED["degenerate_angles"]))
    assert main.run(["solve", str(path)]) == 7
    assert "n_angle: error (degenerate_angles)" in capsys.readouterr().out


def test_a_length_waits_for_a_decision_and_shows_its_figures(solved):
    heights = {"before_z": [-60.0] * 4, "after_z": [-59.5] * 4, "stored_z": -20.0}
    code, undecided = solved(case("length_change", **heights))
    assert (code, undecided["status"], undecided["codes"]) == (7, "error", ["length_changed"])
    assert undecided["z_by_difference_mm"] == -20.5
    for decision, z_mm in (("difference", -20.5), ("keep", -20.0), ("measure", None)):
        code, decided = solved(case("length_change", **heights, decision=decision))
        assert (code, decided["status"], decided["offset_z"]) == (0, "warn", z_mm)
    code, moved = solved(case("length_change", **heights, pin_moved=True))
    assert (code, moved["codes"]) == (7, ["length_not_observable"])


def test_a_station_may_be_undecided(solved):
    shift = {"tool": 1, "vector": [0.1, 0, 0], "touch_sigma_mm": 0.02, "seat_sigma_mm": [0.1] * 3}
    code, answer = solved(case("station_shift", shifts=[shift], tolerance_mm=0.2))
    assert (code, answer["status"], answer["codes"]) == (0, "warn", ["station_undecided"])
    code, pooled = solved(case("station_shift", shifts=[shift], tolerance_mm=0.2, seat_changes=8))
    assert pooled["chi_square_limit"] > answer["chi_square_limit"]


def test_no_method_is_left_untried():
    shared = {
        "two_pose",
        "two_pose_general",
        "n_angle_robust",
        "pivot",
        "up_camera_affine",
        "board_two_fiducials",
        "orientation_convert",
    }
    here = {"find_beams", "joint", "board_fit", "uncertainty_budget"}
    # tests/calibration/test_touch_evidence.py and test_vectors.py
    touching = {"touch_evidence", "verify_evidence"}
    lasting = {"length_change", "station_shift", "needle_chain", "station_chain"}
    assert set(METHODS) == set(MORE) | shared | here | touching | lasting


def test_touches_without_an_arrival_were_seen_by_nobody(solved):
    pose = {"x": 300.0, "y": 100.0, "z": -60.0, "u": 0.0}
    turned = {"x": 324.0, "y": 92.0, "z": -60.0, "u": 180.0}
    arrival = {**turned, "x": 325.0, "z": -57.4}
    for given, notes in ((None, ["touches_not_witnessed"]), (arrival, [])):
        touches = [{"captured": pose, "arrival": None}, {"captured": turned, "arrival": given}]
        code, answer = solved(case("touch_evidence", touches=touches))
        assert (code, answer["notes"]) == (0, notes)


def test_a_proof_of_touches_without_a_stated_scatter_keeps_the_usual_guard_band(solved):
    place = {"x": 300.0, "y": 100.0, "z": -80.0, "u": 90.0}
    found, arrival = {**place, "x": 300.18}, {**place, "x": 301.0, "z": -78.0}
    touches = [{"place": place, "arrival": arrival, "found": found}]
    _, answer = solved(case("verify_evidence", touches=touches, tolerance_mm=0.2))
    assert answer["guard_band_mm"] == pytest.approx(1.65 * 0.03)
    assert (answer["status"], answer["codes"]) == ("warn", ["drift_undecided"])
