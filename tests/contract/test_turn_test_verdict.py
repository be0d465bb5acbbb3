"""A contradicted turn test: who may accept it, and what is then recorded."""

from dataclasses import replace
from itertools import count

import pytest

from robolink.calibration import Drift, TurnClaim, VerifyResult
from robolink.calibration_run import Attended, _records, conclude_turn_test
from robolink.controllers import SimpleController
from robolink.errors import NotAllowedError, VerifyError
from robolink.model import EntryKind, Pose

BEAMS = TurnClaim(
    look_sigma_mm=0.003,
    offset_sigma_mm=0.003,
    headings_deg=(0.0,),
    finds_place=False,
    place_u_mm=0.0115,
    repeatable_mm=0.007,
    accurate_mm=0.028,
)
"""Limits for a turn by 180 degrees: 0.016 from scatter, 0.087 with the place of the beams."""


_numbers = count()


def controller_of_its_own():
    """A controller with its own record."""
    return SimpleController(identity=f"turn-test-verdict-{next(_numbers)}")


def shown(drift_mm: float, u_deg: float = 180.0, limit_mm: float = 0.2) -> VerifyResult:
    return VerifyResult((Drift(u_deg, drift_mm, 0.0),), limit_mm)


def newest(controller: SimpleController):
    return next(iter(controller.outcomes.recorded(kinds=(EntryKind.VERIFY,))))


TAKES_BACK = "Restore the old value."
AGAIN = "Make one more touch."
LEARNS = "Learn the station again."
MOUNT = "Check the mount of the nozzle."
KEEPS = "Keep the value"
RELEARN = ("cell station learn BEAMS-02 --tool 15",)


class Person:
    """Chooses rows by their first words, one after another; records the offered rows."""

    def __init__(self, *answers, again=(), relearning=RELEARN):
        self.answers, self.tests = list(answers), list(again)
        self.asked: list[tuple[str, tuple[str, ...]]] = []
        self.relearning, self.sure = relearning, True
        self.confirmed: list[str] = []

    def choose(self, question, offered):
        rows = tuple(row.does for row in offered.rows)
        self.asked.append((question, rows))
        wanted = self.answers.pop(0)
        (index,) = [at for at, row in enumerate(rows) if row.startswith(wanted)]
        return index

    @property
    def attended(self):
        again = (lambda: self.tests.pop(0)) if self.tests else None
        return Attended(self.choose, self.confirm, again, self.relearning)

    def confirm(self, question):
        self.confirmed.append(question)
        return self.sure


def concluded(proof, person=None, controller=None, claim=BEAMS, **more):
    return conclude_turn_test(
        controller or controller_of_its_own(),
        1,
        proof,
        claim=claim,
        attended=None if person is None else person.attended,
        **more,
    )


def decisions(controller):
    found = controller.outcomes.recorded(kinds=(EntryKind.DECISION,))
    return [one for one in found if one.details.get("chosen")][::-1]


def test_what_agrees_with_the_measurement_asks_nobody():
    person = Person()

    assert concluded(shown(0.012), person).accurate_to_mm == BEAMS.accurate_mm
    assert not person.asked


@pytest.mark.parametrize("drift_mm", [0.1, 0.16])
def test_a_contradicted_accuracy_never_passes_where_nobody_is_asked(drift_mm):
    controller = controller_of_its_own()

    with pytest.raises(VerifyError) as refused:
        conclude_turn_test(controller, 1, shown(drift_mm), claim=BEAMS)

    assert refused.value.code == "proof_contradicts_accuracy"
    entry = newest(controller)
    assert entry.details["passed"] is False
    assert entry.details["verdict"] == "proof_contradicts_accuracy"


def test_a_contradicted_repeatability_is_a_warning_while_the_accuracy_still_covers_it():
    controller = controller_of_its_own()

    proof = conclude_turn_test(controller, 1, shown(0.02), claim=BEAMS)

    assert proof.accurate_to_mm == BEAMS.accurate_mm
    entry = newest(controller)
    assert entry.details["passed"] is True
    assert entry.details["warnings"] == ["proof_contradicts_repeatability"]


def test_a_contradicted_repeatability_that_the_accuracy_does_not_cover_ends_it():
    controller = controller_of_its_own()

    with pytest.raises(VerifyError) as refused:
        conclude_turn_test(controller, 1, shown(0.06), claim=BEAMS)

    assert refused.value.code == "proof_contradicts_repeatability"
    entry = newest(controller)
    assert entry.details["passed"] is False, "what was taken back is not on record as passed"
    assert entry.details["verdict"] == "proof_contradicts_repeatability"
    assert "passed" not in entry.verdict


def test_what_may_follow_is_offered_in_rows_and_the_first_is_the_old_value():
    person = Person(TAKES_BACK, again=[shown(0.1)])

    with pytest.raises(VerifyError) as refused:
        concluded(touched(0.1), person)

    assert refused.value.code == "proof_contradicts_accuracy"
    ((question, rows),) = person.asked
    assert "0.100 mm off" in question
    assert rows == (
        TAKES_BACK,
        AGAIN,
        LEARNS,
        MOUNT,
        "Keep the value with a wider statement: accurate to +-0.107 mm, not +-0.028 mm.",
    )


def touched(drift_mm):
    return replace(shown(drift_mm), inputs=(Pose(1, 2, 3, 180),))


def test_a_sensor_looks_once_more_and_nothing_is_offered_that_cannot_be_done():
    looking = Person(TAKES_BACK, again=[shown(0.1)], relearning=())
    with pytest.raises(VerifyError):
        concluded(shown(0.1), looking)
    assert looking.asked[0][1][1] == "Measure once more with the camera."
    assert LEARNS not in looking.asked[0][1]

    once = Person(TAKES_BACK)
    with pytest.raises(VerifyError):
        concluded(shown(0.1), once)
    assert once.asked[0][1][:3] == (TAKES_BACK, LEARNS, MOUNT)


def test_a_person_takes_a_wider_statement_and_it_is_on_record():
    controller, person = controller_of_its_own(), Person(KEEPS)

    proof = concluded(shown(0.1), person, controller)

    assert proof.accurate_to_mm == pytest.approx(0.1 + 2.45 * 0.003)
    (entry,) = decisions(controller)
    assert entry.tool == 1
    assert entry.details["accurate_to_mm"] == pytest.approx(proof.accurate_to_mm)
    assert (entry.details["chosen"], entry.details["accepted"]) == ("wider", True)


def test_a_number_alone_keeps_no_value_because_rows_change_their_numbers():
    controller, person = controller_of_its_own(), Person(KEEPS)
    person.sure = False

    with pytest.raises(VerifyError):
        concluded(shown(0.1), person, controller)

    assert person.confirmed == [
        "Keep the value and state that it is accurate to +-0.107 mm, not +-0.028 mm?"
    ]
    assert decisions(controller)[0].details["chosen"] == "take_back"


def test_a_doubt_that_the_accuracy_covers_may_be_kept_as_stated():
    controller, person = controller_of_its_own(), Person(KEEPS)

    assert concluded(shown(0.02), person, controller).accurate_to_mm == BEAMS.accurate_mm
    assert "accurate to +-0.028 mm, as stated" in person.asked[0][1][-1]
    assert decisions(controller)[0].details["chosen"] == "keep"


@pytest.mark.parametrize(
    ("answer", "chosen", "remedy", "commands"),
    [
        (TAKES_BACK, "take_back", "Check that nozzle and station are tight", ()),
        (MOUNT, "check_mount", "measure the tip anew", ()),
        (LEARNS, "learn_station", "'robolink cell station learn BEAMS-02 --tool 15'", RELEARN),
    ],
)
@pytest.mark.parametrize("drift_mm", [0.1, 0.06, 0.02])
def test_a_step_that_would_tell_ends_with_the_old_value_and_says_what_to_do(
    answer, chosen, remedy, commands, drift_mm
):
    controller = controller_of_its_own()

    with pytest.raises(VerifyError) as refused:
        concluded(shown(drift_mm), Person(answer), controller)

    assert refused.value.code.startswith("proof_contradicts_")
    assert remedy in refused.value.remedy
    assert refused.value.next_commands == commands
    (entry,) = decisions(controller)
    assert (entry.details["chosen"], entry.details["accepted"]) == (chosen, False)


def test_once_more_counts_all_looks_and_each_is_on_record():
    controller, person = controller_of_its_own(), Person("Measure once", again=[shown(0.004)])

    proof = concluded(shown(0.018), person, controller)

    (drift,) = proof.drifts
    assert (drift.dx_mm, drift.looks) == (pytest.approx(0.011), 2)
    assert proof.judgement is not None
    assert proof.judgement.tests == 2
    assert not proof.judgement.good, "it is not called passed"
    entries = [*controller.outcomes.recorded(kinds=(EntryKind.VERIFY,))][::-1]
    assert [one.details["passed"] for one in entries] == [True, True]
    assert [len(one.details.get("tests", [1])) for one in entries] == [1, 2]
    assert entries[1].details["warnings"] == ["turn_test_repeated"]
    assert [one.details["chosen"] for one in decisions(controller)] == ["again"]


def test_whoever_looks_until_it_fits_gets_no_pass():
    person = Person("Measure once", "Measure once", TAKES_BACK, again=[shown(0.0), shown(0.0)])

    with pytest.raises(VerifyError) as refused:
        concluded(shown(0.1), person)

    assert refused.value.code == "proof_contradicts_repeatability"
    assert "are 0.100 mm apart" in person.asked[-1][0]
    assert "Measure once more with the camera." not in person.asked[-1][1], "twice at most"
    widened = person.asked[-1][1][-1]
    assert "+-0.107 mm" in widened, "the worst look counts"


def test_once_more_beyond_the_limit_of_the_process_is_that_and_ends_it():
    controller = controller_of_its_own()
    with pytest.raises(VerifyError) as refused:
        concluded(shown(0.1), Person("Measure once", again=[shown(0.25)]), controller)
    assert refused.value.code == "large_drift"
    assert newest(controller).details["passed"] is False


def test_what_was_seen_before_a_break_counts_with_what_is_seen_after_it():
    person = Person(TAKES_BACK)
    with pytest.raises(VerifyError):
        concluded(shown(0.0), person, earlier=[shown(0.1)])
    assert "mm apart" in person.asked[0][0]

    controller = controller_of_its_own()
    controller.outcomes.change = "c1"
    with pytest.raises(VerifyError):
        concluded(shown(0.1), Person("Measure once", TAKES_BACK, again=[shown(0.0)]), controller)
    kept = _records.tests_on_record(controller.outcomes, 1, shown(0.001))
    assert [one.drifts[0].dx_mm for one in kept] == [0.1, 0.0]
    controller.outcomes.change = "c2"
    assert _records.tests_on_record(controller.outcomes, 1, shown(0.001)) == []


def test_a_wider_statement_beyond_the_limit_of_the_process_is_not_offered():
    person = Person(TAKES_BACK)

    with pytest.raises(VerifyError):
        concluded(shown(0.1), person, interval_mm=0.05)

    assert person.asked[0][1] == (TAKES_BACK, LEARNS, MOUNT)


def test_an_operator_may_not_widen_a_statement():
    controller = controller_of_its_own()
    controller.outcomes.signature = controller.outcomes.signature.__class__(
        operator="Kim", role="operator"
    )

    with pytest.raises(NotAllowedError):
        concluded(shown(0.1), Person(KEEPS), controller)


def test_what_a_camera_may_see_wrong_is_not_widened_by_what_it_saw():
    camera = TurnClaim(
        look_sigma_mm=0.002,
        offset_sigma_mm=0.001,
        headings_deg=(0.0, 60.0, 120.0, 180.0),
        finds_place=True,
        accurate_mm=0.01,
        by_camera=True,
    )
    person = Person(TAKES_BACK)

    with pytest.raises(VerifyError) as refused:
        concluded(shown(0.03), person, claim=camera)

    assert refused.value.code == "proof_contradicts_accuracy"
    assert "camera" in refused.value.remedy
    assert person.asked[0][1] == (TAKES_BACK, LEARNS, MOUNT)


def test_too_large_a_drift_is_that_first():
    with pytest.raises(VerifyError) as refused:
        concluded(shown(0.3), Person())

    assert refused.value.code == "large_drift"


def test_a_small_turn_is_no_test_though_nothing_is_contradicted():
    controller = controller_of_its_own()

    conclude_turn_test(controller, 1, shown(0.001, u_deg=45.0), claim=BEAMS)

    entry = newest(controller)
    assert entry.details["warnings"] == ["tested_at_small_angle"]
    assert entry.details["judgement"]["small_angle"] is True


def test_without_a_claim_the_limit_of_the_process_decides_alone():
    assert concluded(shown(0.1), claim=None).accurate_to_mm is None
