"""The tests of the simulated mailbox, repeated with the exported program (soak)."""

import pytest
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

FIXTURE = "mailbox_program"
MODELLED, EXECUTED = "modelled", "executed"

DIFFERING = {
    "test_the_heartbeat_counts_the_cycles_of_the_motion_task": "cycles in which nothing happens "
    "are left out (docs/reference/structured_text.md 4.2)",
    "test_a_number_may_be_given_and_a_program_may_have_none": "the exported program has a number",
    "test_the_state_of_an_interrupted_movement_is_shown_while_it_is_the_last_command": "nothing "
    "tells a program that another one has interrupted its movement",
}
"""Tests that hold for the modelled program alone, with reasons."""


def offer_programs(metafunc: pytest.Metafunc) -> None:
    """Parametrize a test with each program that can run the mailbox."""
    if FIXTURE not in metafunc.fixturenames:
        return
    programs: list[object] = [MODELLED]
    if metafunc.function.__name__ not in DIFFERING:
        programs.append(pytest.param(EXECUTED, marks=pytest.mark.soak))
    metafunc.parametrize(FIXTURE, programs, indirect=True)


@pytest.fixture
def mailbox_program(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """The name of the program that a simulated PLC gets by default."""
    name: str = request.param
    if name == EXECUTED:
        from tests.unit.structured_text._behaviours import of_program

        defaults = SoftMotionSimulator.__init__.__kwdefaults__
        assert defaults is not None
        monkeypatch.setitem(defaults, "make_plc", of_program())
    return name
