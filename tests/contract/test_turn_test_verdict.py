"""A turn test that contradicts its measurement: who may let it pass, and what is on record then."""

import pytest

from robolink.calibration import Drift, TurnClaim, VerifyResult
from robolink.errors import NotAllowedError, VerifyError
from robolink.model import EntryKind
from robolink.nozzle_change import conclude_turn_test
from robolink.testing import MemoryController

BEAMS = TurnClaim(
    look_sigma_mm=0.003,
    offset_sigma_mm=0.003,
    headings_deg=(0.0,),
    finds_place=False,
    place_u_mm=0.0115,
    repeatable_mm=0.007,
    accurate_mm=0.028,
)
"""Limits of a turn by 180 degrees: 0.016 by scatter, 0.087 with the place of the beams."""


def shown(drift_mm: float, u_deg: float = 180.0, limit_mm: float = 0.2) -> VerifyResult:
    return VerifyResult((Drift(u_deg, drift_mm, 0.0),), limit_mm)


def newest(controller: MemoryController):
    return next(iter(controller.outcomes.recorded(kinds=(EntryKind.VERIFY,))))


class Person:
    def __init__(self, answer):
        self.answer = answer
        self.asked: list[str] = []

    def __call__(self, question):
        self.asked.append(question)
        return self.answer


def test_what_agrees_with_the_measurement_asks_nobody():
    person = Person(False)

    stated = conclude_turn_test(MemoryController(), 1, shown(0.012), claim=BEAMS, confirm=person)

    assert stated == BEAMS.accurate_mm
    assert not person.asked


@pytest.mark.parametrize("drift_mm", [0.1, 0.16])
def test_a_contradicted_accuracy_never_passes_where_nobody_is_asked(drift_mm):
    controller = MemoryController()

    with pytest.raises(VerifyError) as refused:
        conclude_turn_test(controller, 1, shown(drift_mm), claim=BEAMS)

    assert refused.value.code == "proof_contradicts_accuracy"
    entry = newest(controller)
    assert entry.details["passed"] is False
    assert entry.details["verdict"] == "proof_contradicts_accuracy"


def test_a_contradicted_repeatability_is_a_warning_while_the_accuracy_still_covers_it():
    controller = MemoryController()

    stated = conclude_turn_test(controller, 1, shown(0.02), claim=BEAMS)

    assert stated == BEAMS.accurate_mm
    entry = newest(controller)
    assert entry.details["passed"] is True
    assert entry.details["warnings"] == ["proof_contradicts_repeatability"]


def test_a_contradicted_repeatability_that_the_accuracy_does_not_cover_ends_it():
    controller = MemoryController()

    with pytest.raises(VerifyError) as refused:
        conclude_turn_test(controller, 1, shown(0.06), claim=BEAMS)

    assert refused.value.code == "proof_contradicts_repeatability"
    entry = newest(controller)
    assert entry.details["passed"] is False, "what was taken back is not on record as passed"
    assert entry.details["verdict"] == "proof_contradicts_repeatability"
    assert "passed" not in entry.verdict


def test_a_person_takes_a_wider_statement_and_it_is_on_record():
    controller, person = MemoryController(), Person(True)

    stated = conclude_turn_test(controller, 1, shown(0.1), claim=BEAMS, confirm=person)

    assert stated == pytest.approx(0.1 + 2.45 * 0.003)
    (question,) = person.asked
    assert "+-0.107" in question
    assert "+-0.028" in question
    (entry,) = [
        one
        for one in controller.outcomes.recorded(kinds=(EntryKind.DECISION,))
        if one.details.get("code")
    ]
    assert entry.tool == 1
    assert entry.details["accurate_to_mm"] == pytest.approx(stated)
    assert entry.details["question"] == question


def test_a_no_takes_the_value_back():
    with pytest.raises(VerifyError) as refused:
        conclude_turn_test(MemoryController(), 1, shown(0.1), claim=BEAMS, confirm=Person(False))

    assert refused.value.code == "proof_contradicts_accuracy"


def test_a_wider_statement_beyond_the_limit_of_the_process_is_not_offered():
    person = Person(True)

    with pytest.raises(VerifyError):
        conclude_turn_test(
            MemoryController(), 1, shown(0.1), claim=BEAMS, interval_mm=0.05, confirm=person
        )

    assert not person.asked


def test_an_operator_may_not_widen_a_statement():
    controller = MemoryController()
    controller.outcomes.signature = controller.outcomes.signature.__class__(
        operator="Kim", role="operator"
    )

    with pytest.raises(NotAllowedError):
        conclude_turn_test(controller, 1, shown(0.1), claim=BEAMS, confirm=Person(True))


def test_what_a_camera_may_see_wrong_is_not_widened_by_what_it_saw():
    person, claim = (
        Person(True),
        TurnClaim(
            look_sigma_mm=0.002,
            offset_sigma_mm=0.001,
            headings_deg=(0.0, 60.0, 120.0, 180.0),
            finds_place=True,
            accurate_mm=0.01,
            by_camera=True,
        ),
    )

    with pytest.raises(VerifyError) as refused:
        conclude_turn_test(MemoryController(), 1, shown(0.03), claim=claim, confirm=person)

    assert refused.value.code == "proof_contradicts_accuracy"
    assert "camera" in refused.value.remedy
    assert not person.asked


def test_too_large_a_drift_is_that_first():
    with pytest.raises(VerifyError) as refused:
        conclude_turn_test(MemoryController(), 1, shown(0.3), claim=BEAMS, confirm=Person(True))

    assert refused.value.code == "large_drift"


def test_a_small_turn_is_no_test_though_nothing_is_contradicted():
    controller = MemoryController()

    conclude_turn_test(controller, 1, shown(0.001, u_deg=45.0), claim=BEAMS)

    entry = newest(controller)
    assert entry.details["warnings"] == ["tested_at_small_angle"]
    assert entry.details["judgement"]["small_angle"] is True


def test_without_a_claim_the_limit_of_the_process_decides_alone():
    assert conclude_turn_test(MemoryController(), 1, shown(0.1), claim=None) is None
