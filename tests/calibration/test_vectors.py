"""Cases with exact answers: those kept here, and the project's shared file where it is."""

import json
import math
from pathlib import Path

import pytest
from robolink_cli.commands.measure.solve.answer import solve_document
from robolink_cli.commands.measure.solve.case import Node

OWN = Path(__file__).with_name("cases.json")
SHARED = Path(__file__).parents[2].parent / "shared" / "vectors" / "calibration.json"


def cases(path):
    return json.loads(path.read_text())["vectors"] if path.is_file() else []


def flat(value):
    return [item for part in value for item in flat(part)] if isinstance(value, list) else [value]


def check(case):
    expected = case["expected"]
    found = solve_document(Node(case, ""))
    assert (found["status"], found["codes"]) == (expected["status"], expected["codes"])
    for key in set(expected) - {"status", "codes"}:
        bound = {"abs": case["tolerance"]}
        if key == "sigma_gain_per_axis":
            bound = {"rel": case["tolerance"]}
        assert flat(found[key]) == pytest.approx(flat(expected[key]), **bound), key


@pytest.mark.parametrize("case", cases(OWN), ids=lambda case: case["id"])
def test_a_kept_case_gives_its_answer(case):
    check(case)


@pytest.mark.skipif(not SHARED.is_file(), reason="the shared cases are not beside the repository")
@pytest.mark.parametrize("case", cases(SHARED), ids=lambda case: case["id"])
def test_a_shared_case_gives_its_answer(case):
    check(case)


def test_every_method_and_verdict_of_the_cases_is_kept():
    kept = cases(OWN)
    assert len(kept) == 13
    assert {case["expected"]["status"] for case in kept} == {"ok", "warn", "error"}
    assert len({case["method"] for case in kept}) == 9


def test_a_refused_pose_is_named_by_its_path():
    (case,) = (case for case in cases(OWN) if case["id"] == "nan_pose")
    assert case["input"]["nan_fields"][0] in str(solve_document(Node(case, ""))["what"])


def test_a_file_with_vectors_is_answered_as_a_whole():
    document = solve_document(Node(json.loads(OWN.read_text()), ""))
    results = document["results"]
    assert isinstance(results, list)
    assert document["status"] == "error"
    assert [result["id"] for result in results] == [case["id"] for case in cases(OWN)]
    assert all(math.isfinite(result.get("rms_residual") or 0.0) for result in results)
