"""Every end of a job has a row: each exit code, each error of the product, each state."""

import re
from pathlib import Path

import pytest
from robolink_cli.console.exit_codes import MEANINGS

from robolink.errors import NotReadyReason
from robolink.fleet import MOST_TRIES, Treatment, pause_s, treatment_of
from robolink.fleet.outcome_codes import BY_CODE, BY_ERROR, BY_REASON

ROOT = Path(__file__).parents[2]
CLASS = re.compile(r"^class (\w+)\(([^)]*)\):", re.M)


def error_names() -> set[str]:
    """Return the name of every class of errors in the sources, wherever it is defined."""
    bases = dict[str, set[str]]()
    for room in ("robolink", "cli", "simulators"):
        for path in (ROOT / room).rglob("*.py"):
            for name, said in CLASS.findall(path.read_text(encoding="utf-8")):
                bases[name] = {one.strip().rpartition(".")[2] for one in said.split(",")}
    found = {"RobolinkError"}
    while more := {name for name, of in bases.items() if of & found} - found:
        found |= more
    return found


def test_every_exit_code_of_the_product_has_a_row():
    assert set(BY_CODE) == set(MEANINGS)


def test_every_error_of_the_product_has_a_row_and_every_row_an_error():
    assert set(BY_ERROR) == error_names()


def test_every_state_that_is_not_ready_has_a_row():
    assert set(BY_REASON) == set(NotReadyReason)


def test_only_a_cell_that_is_busy_locked_or_not_reached_is_tried_again():
    again = {name for name, treatment in BY_ERROR.items() if treatment.again}
    assert again == {
        *("BusyError", "LeaseHeldError", "LeaseLostError"),
        *("ConnectError", "LoginUnansweredError", "TransportBrokenError", "TransportClosedError"),
        *("TransportError", "TransportTimeoutError"),
    }
    assert {code for code, treatment in BY_CODE.items() if treatment.again} == {3}
    reasons = {reason for reason, treatment in BY_REASON.items() if treatment.again}
    assert reasons == {NotReadyReason.RUNNING, NotReadyReason.STARTING}


@pytest.mark.parametrize(
    ("code", "error", "reason", "expected"),
    [
        (6, "TransportBrokenError", "", Treatment.UNSETTLED),
        (6, "LeaseHeldError", "", Treatment.UNSETTLED),
        (0, "", "", Treatment.DONE),
        (130, "Interrupted", "", Treatment.PERSON),
        (143, "BusyError", "", Treatment.PERSON),
        (5, "NotReadyError", "emergency_stop", Treatment.PERSON),
        (5, "NotReadyError", "running", Treatment.BUSY),
        (5, "NotReadyError", "of a newer robolink", Treatment.PERSON),
        (5, "AnErrorOfAPlugIn", "", Treatment.PERSON),
        (3, "AnErrorOfAPlugIn", "", Treatment.OFF),
        (2, "JournalError", "", Treatment.HALT),
        (2, "ConfigError", "", Treatment.PERSON),
        (70, "KeyError", "", Treatment.HALT),
        (-9, "", "", Treatment.HALT),
        (42, "BusyError", "", Treatment.HALT),
    ],
)
def test_what_stands_outranks_what_broke(code, error, reason, expected):
    assert treatment_of(code, error, reason) is expected


def test_all_tries_of_a_job_fit_into_a_night():
    assert 6 < sum(pause_s(one) for one in range(1, MOST_TRIES)) / 3600 < 9
