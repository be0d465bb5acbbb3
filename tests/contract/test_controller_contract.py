"""Every kind of controller passes the contract checks of ``robolink.testing``."""

import pytest

from robolink.testing import (
    MOVING_CHECKS,
    READING_CHECKS,
    WRITING_CHECKS,
    WRITING_WHILE_MOVING_CHECKS,
    outcomes,
)
from tests.contract._kinds import IMMOBILE, KINDS, OVER_OPCUA

STANDING = (*READING_CHECKS, *WRITING_CHECKS)
MOVING = (*MOVING_CHECKS, *WRITING_WHILE_MOVING_CHECKS)


def checks_of(kind):
    """Return the checks that a kind has to pass."""
    return STANDING if kind in IMMOBILE else (*STANDING, *MOVING)


def broken_by(subject, checks):
    return [f"{it.name}: {it.broken}" for it in outcomes(subject, checks) if it.broken]


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_of_controller_keeps_its_promises(kind):
    with KINDS[kind]() as cell:
        assert broken_by(cell.subject, checks_of(kind)) == []


@pytest.mark.soak
@pytest.mark.parametrize("kind", OVER_OPCUA)
def test_a_kind_of_controller_keeps_its_promises_over_opc_ua(kind):
    with OVER_OPCUA[kind]() as cell:
        assert broken_by(cell.subject, checks_of(kind)) == []
