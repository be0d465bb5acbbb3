"""The shared cases of evidence, compared as their conventions say, where the file is."""

import json
from pathlib import Path

import pytest
from robolink_cli.commands.measure.solve.answer import METHODS, solve_document
from robolink_cli.commands.measure.solve.case import Node

SHARED = Path(__file__).parents[2].parent / "shared" / "vectors" / "evidence.json"
QUANTILES = ("limit", "upper99", "coverage_factor", "expanded", "detectable")


def cases():
    return json.loads(SHARED.read_text())["vectors"] if SHARED.is_file() else []


def flat(value):
    if isinstance(value, dict):
        value = [value[name] for name in sorted(value)]
    return [item for part in value for item in flat(part)] if isinstance(value, list) else [value]


def check(case, found):
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
        for one, wanted in zip(flat(found[key]), flat(expected[key]), strict=True):
            if isinstance(wanted, float):
                assert one == pytest.approx(wanted, rel=relative, abs=absolute), key
            else:
                assert one == wanted, key


@pytest.mark.skipif(not SHARED.is_file(), reason="the shared cases are not beside the repository")
@pytest.mark.parametrize("case", cases(), ids=lambda case: case["id"])
def test_a_shared_case_of_evidence_gives_its_answer(case):
    check(case, solve_document(Node(case, "")))


@pytest.mark.skipif(not SHARED.is_file(), reason="the shared cases are not beside the repository")
def test_the_whole_file_is_answered_case_by_case():
    document = json.loads(SHARED.read_text())
    results = solve_document(Node(document, ""))["results"]
    assert isinstance(results, list)
    assert [result["id"] for result in results] == [case["id"] for case in document["vectors"]]
    assert {case["method"] for case in document["vectors"]} <= set(METHODS)
