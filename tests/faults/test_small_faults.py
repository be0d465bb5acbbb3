"""One small fault of the wire in a whole two-pose calibration, of every kind.

A request or an answer is dropped, late, doubled, cut short at any byte, or one bit of an answer is
flipped, at the first exchange of each shape in each step of the calibration. By default a sample;
all with ``make soak``, and with ``python -m tests.faults.small``, which can be interrupted and
prints the counts.
"""

import random
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from tests.faults.small.cells import KINDS
from tests.faults.small.faults_of_a_run import Pair, Planned, drawn, planned, recorded, run_with
from tests.faults.small.outcomes import outcome
from tests.faults.small.wire import Act, SmallFault

_SAMPLE = {"EPSON": 6, "PLC": 1}
_SHARES, _SHARES_A_NIGHT = 24, 4
"""All of them take longer than the rest of a night."""

DECISIVE = {
    "EPSON": Pair('$Execute,"TLSet #, XY(#, #, #, #)"', "writing, TLSet #,"),
    "PLC": Pair("write_command WRITE_TOOL #", "writing, # WRITE_TOOL #"),
}


def told(runs: list[Planned]) -> Counter[str]:
    """Make runs and count their ends; fail with the first that broke a promise."""
    ends = Counter[str]()
    for run in runs:
        ended = outcome(run)
        assert not ended.startswith("WRONG"), f"{run}: {ended}"
        ends[ended] += run.members
    return ends


@pytest.mark.fault("F07", "F26")
@pytest.mark.parametrize("kind", KINDS)
def test_a_sample_of_small_faults_costs_no_second_movement_and_no_wrong_value(kind):
    runs = drawn(kind, _SAMPLE[kind], seed=15)
    ends = told(runs)
    print(f"\n{kind}: {ends.total()} faults in {len(runs)} runs: {dict(ends)}")  # noqa: T201
    assert set(ends) != {"done"}  # the driver did meet the faults


@pytest.mark.soak
@pytest.mark.parametrize("kind", KINDS)
def test_a_write_whose_answer_is_lost_ends_as_unknown_and_one_that_never_came_too(kind):
    ends = {
        act: run_with(kind, DECISIVE[kind], SmallFault(act))
        for act in (Act.DROP_REQUEST, Act.DROP_REPLY)
    }
    assert set(ends.values()) == {"exit 6"}


def test_each_step_of_a_calibration_is_met():
    for kind in KINDS:
        pairs = recorded(kind).replies
        steps = {pair.step.partition(",")[0] for pair in pairs}
        assert steps == {"before", "measuring", "writing", "proving"}
        assert DECISIVE[kind] in pairs


@pytest.fixture(scope="module")
def first_share() -> int:
    """Number drawn from the commit; 0 in sources without one."""
    asked = subprocess.run(
        ("git", "rev-parse", "HEAD"),
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=False,
    )
    return int(asked.stdout.strip() or "0", 16) % _SHARES


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("turn", range(_SHARES_A_NIGHT))
@pytest.mark.parametrize("kind", KINDS)
def test_a_sixth_of_all_small_faults(kind, turn, first_share):
    share = (first_share + turn) % _SHARES
    runs = list(planned(kind))
    random.Random(15).shuffle(runs)
    ends = told(runs[share::_SHARES])
    print(f"\n{kind}, share {share}: {ends.total()} faults: {dict(ends)}")  # noqa: T201
    assert len(ends) > 1  # not all of them alike
