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
CASES = [
    *((kind, check) for kind in KINDS for check in STANDING),
    *((kind, check) for kind in KINDS if kind not in IMMOBILE for check in MOVING),
]


@pytest.mark.parametrize(
    ("kind", "check"), CASES, ids=[f"{kind}-{check.__name__}" for kind, check in CASES]
)
def test_a_kind_of_controller_keeps_its_promises(kind, check):
    with KINDS[kind]() as cell:
        check(cell.subject)


@pytest.mark.soak
@pytest.mark.parametrize("kind", OVER_OPCUA)
def test_a_kind_of_controller_keeps_its_promises_over_opc_ua(kind):
    checks = STANDING if kind in IMMOBILE else (*STANDING, *MOVING)
    with OVER_OPCUA[kind]() as cell:
        broken = [f"{it.name}: {it.broken}" for it in outcomes(cell.subject, checks) if it.broken]
    assert broken == []
