"""Cases with exact or published answers: our own, shared ones, and data of real trackers."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from robolink_cli.commands.measure.solve.answer import METHODS, solve_document
from robolink_cli.commands.measure.solve.case import Node

from robolink.calibration import Robust, quaternion_rotations, solve_pivot, uvw_deg
from robolink.model import Pose

# Cases with exact answers: those kept here, and the project's shared file where it is.

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


# The shared cases of evidence, compared as their conventions say, where the file is.

SHARED_EVIDENCE = Path(__file__).parents[2].parent / "shared" / "vectors" / "evidence.json"
QUANTILES = ("limit", "upper99", "coverage_factor", "expanded", "detectable")


def evidence_cases():
    return json.loads(SHARED_EVIDENCE.read_text())["vectors"] if SHARED_EVIDENCE.is_file() else []


def flat_evidence(value):
    if isinstance(value, dict):
        value = [value[name] for name in sorted(value)]
    return (
        [item for part in value for item in flat_evidence(part)]
        if isinstance(value, list)
        else [value]
    )


def check_evidence(case, found):
    expected = case["expected"]
    if expected["status"] == "error":
        assert found["status"] == "error"
        assert set(expected["codes"]) & set(found["codes"])
        return
    assert found["status"] == expected["status"], found
    assert set(expected["codes"]) <= set(found["codes"])
    assert set(expected.get("codes_absent", ())).isdisjoint(found["codes"])
    assert set(expected.get("notes", ())) <= set(found.get("notes", ()))
    for key in set(expected) - {"status", "codes", "codes_absent", "notes"}:
        relative = 0.01 if any(word in key for word in QUANTILES) else None
        absolute = 0.0 if relative else case["tolerance"]
        for one, wanted in zip(
            flat_evidence(found[key]), flat_evidence(expected[key]), strict=True
        ):
            if isinstance(wanted, float):
                assert one == pytest.approx(wanted, rel=relative, abs=absolute), key
            else:
                assert one == wanted, key


@pytest.mark.skipif(
    not SHARED_EVIDENCE.is_file(), reason="the shared cases are not beside the repository"
)
@pytest.mark.parametrize("case", evidence_cases(), ids=lambda case: case["id"])
def test_a_shared_case_of_evidence_gives_its_answer(case):
    check_evidence(case, solve_document(Node(case, "")))


@pytest.mark.skipif(
    not SHARED_EVIDENCE.is_file(), reason="the shared cases are not beside the repository"
)
def test_the_whole_file_is_answered_case_by_case():
    document = json.loads(SHARED_EVIDENCE.read_text())
    results = solve_document(Node(document, ""))["results"]
    assert isinstance(results, list)
    assert [result["id"] for result in results] == [case["id"] for case in document["vectors"]]
    assert {case["method"] for case in document["vectors"]} <= set(METHODS)


# Real optical-tracker pivots with published answers (LSQRRecipes, Yaniv, BSD-3 style).
#
# The data are not part of the source archive; the tests skip where the folder is absent.

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "pivot"
PUBLISHED_TIP = (-17.7799, 1.1113, -156.865)
PUBLISHED_POINT = (146.901, -62.9689, -1042.14)


def poses(name):
    table = np.loadtxt(DATA / name)
    turned = quaternion_rotations(table[:, 3:])
    found = []
    for (x, y, z), matrix in zip(table[:, :3].tolist(), turned, strict=True):
        u, v, w = uvw_deg(matrix)
        found.append(Pose(x, y, z, u, v, w))
    return found


@pytest.mark.skipif(
    not DATA.is_dir(), reason="the tracker data lie beside the repository and are not there"
)
def test_the_clean_set_gives_the_published_least_squares():
    result = solve_pivot(poses("lsqrrecipes_pivot_clean.txt"))
    assert len(result.inputs) == 481
    # Published with six digits: half a unit of the last is 0.0005 for the longest.
    assert result.offset.components()[:3] == pytest.approx(PUBLISHED_TIP, abs=0.001)
    assert result.reference_point_mm == pytest.approx(PUBLISHED_POINT, abs=0.005)


@pytest.mark.skipif(
    not DATA.is_dir(), reason="the tracker data lie beside the repository and are not there"
)
@pytest.mark.parametrize("robust", [Robust(threshold_mm=1.0), Robust()], ids=["1 mm", "unknown"])
def test_the_outliers_are_found_among_real_poses(robust):
    clean = solve_pivot(poses("lsqrrecipes_pivot_clean.txt")).offset.components()[:3]
    spoilt = poses("lsqrrecipes_pivot_outliers.txt")
    plain = solve_pivot(spoilt).offset.components()[:3]
    assert np.linalg.norm(np.subtract(plain, clean)) > 25
    result = solve_pivot(spoilt, robust=robust)
    assert np.linalg.norm(np.subtract(result.offset.components()[:3], clean)) < 0.45
    assert 480 - len(result.rejected) >= 320


@pytest.mark.skipif(
    not DATA.is_dir(), reason="the tracker data lie beside the repository and are not there"
)
def test_every_seed_finds_the_same_set_among_real_poses():
    """On such data, plain refits under single seeds gave 11 answers, 0.6 mm apart."""
    spoilt = poses("lsqrrecipes_pivot_outliers.txt")
    found = {solve_pivot(spoilt, robust=Robust(2.0, seeds=(k,))).rejected for k in range(8)}
    assert len(found) == 1
    together = solve_pivot(spoilt, robust=Robust(2.0))
    assert {together.rejected} == found
    assert together.evidence is not None
    assert together.evidence.seed_spread_mm == 0.0
