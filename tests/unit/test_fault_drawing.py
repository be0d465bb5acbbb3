"""One seed is one plan."""

import hashlib

import pytest
from robolink_simulators.faults import (
    FaultAction,
    FaultNotPossibleError,
    FaultPlan,
    FaultRates,
    LinkKind,
    PlcFaultAction,
    drawn_faults,
    drawn_plc_faults,
    links_of,
)
from robolink_simulators.faults.drawn import ONLY_BY_NAME
from robolink_simulators.faults.stream import EXCEPTION_CODES
from robolink_simulators.softmotion.mailbox.exchange import WireFaults

from robolink.errors import ConfigError

RATES = FaultRates(rate=0.05, exchanges=2000)
STREAMS = (LinkKind.EPSON_TCP, LinkKind.EPSON_SERIAL, LinkKind.PLC_RTU)
MAILBOXES = (LinkKind.MODBUS_TCP, LinkKind.MODBUS_RTU, LinkKind.CAN, LinkKind.MAILBOX_SIM)


def test_a_seed_draws_the_same_plan_on_every_machine():
    """The digest stands here, so that another Python, or another order of a set, shows."""
    drawn = (*drawn_faults(7, LinkKind.EPSON_TCP, RATES), *drawn_plc_faults(7, LinkKind.CAN, RATES))
    assert hashlib.sha256(repr(drawn).encode()).hexdigest()[:16] == "464a8a8679b527eb"


def test_another_seed_draws_another_plan():
    assert drawn_faults(1, LinkKind.EPSON_TCP, RATES) != drawn_faults(2, LinkKind.EPSON_TCP, RATES)


@pytest.mark.parametrize("kind", STREAMS)
def test_all_that_a_stream_can_have_is_drawn_and_nothing_else(kind):
    drawn = {fault.action for fault in drawn_faults(3, kind, FaultRates(0.5, 2000))}
    possible = {action for action in FaultAction if kind in links_of(action)}
    assert drawn == possible - ONLY_BY_NAME


@pytest.mark.parametrize("kind", MAILBOXES)
def test_all_that_a_mailbox_can_have_is_drawn_and_nothing_else(kind):
    drawn = {fault.action for fault in drawn_plc_faults(3, kind, FaultRates(0.5, 2000))}
    possible = {action for action in PlcFaultAction if kind in links_of(action)}
    assert drawn == possible - ONLY_BY_NAME


def test_modbus_exceptions_are_drawn_by_name_with_codes_that_there_are():
    asked = FaultRates(0.5, 2000, (FaultAction.MODBUS_EXCEPTION,))
    assert {it.code for it in drawn_faults(3, LinkKind.PLC_RTU, asked)} == {*EXCEPTION_CODES}
    asked = FaultRates(0.5, 2000, (PlcFaultAction.MODBUS_EXCEPTION,))
    assert {it.code for it in drawn_plc_faults(3, LinkKind.MODBUS_TCP, asked)} == {*EXCEPTION_CODES}


def test_as_many_as_the_rate_says():
    count = len(drawn_faults(5, LinkKind.EPSON_TCP, FaultRates(0.01, 100_000)))
    assert 900 < count < 1100  # three standard deviations are 95


def test_the_actions_do_not_move_the_exchanges():
    few = FaultRates(0.05, 2000, actions=(FaultAction.DELAY,))
    all_of_them = [fault.on_exchange for fault in drawn_faults(7, LinkKind.EPSON_TCP, RATES)]
    assert [it.on_exchange for it in drawn_faults(7, LinkKind.EPSON_TCP, few)] == all_of_them


def test_a_plan_is_drawn_ready_to_be_taken_from():
    plan = FaultPlan.drawn(7, LinkKind.EPSON_TCP, RATES)
    assert plan.pending == drawn_faults(7, LinkKind.EPSON_TCP, RATES)
    fired = [len(plan.take("$GetStatus")) for _ in range(2000)]
    assert sum(fired) == len(plan.fired) > 50
    assert plan.pending == ()
    assert WireFaults.drawn(7, LinkKind.CAN, RATES).pending


def test_what_a_link_cannot_have_is_not_drawn_for_it():
    wanted = FaultRates(actions=(PlcFaultAction.ECHO,))
    with pytest.raises(FaultNotPossibleError, match="echo"):
        drawn_plc_faults(1, LinkKind.MODBUS_TCP, wanted)


@pytest.mark.parametrize(
    "numbers", [{"rate": 1.1}, {"rate": -0.1}, {"exchanges": -1}, {"exchanges": 10**7}]
)
def test_rates_have_limits(numbers):
    with pytest.raises(ConfigError):
        FaultRates(**numbers)
