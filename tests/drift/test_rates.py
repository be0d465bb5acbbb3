"""How often a steady cell is suspected, and how soon a change is seen; for docs/accuracy.md."""

from collections import Counter
from statistics import median

import pytest

from tests.drift._courses import course, found, steady

pytestmark = [pytest.mark.soak, pytest.mark.timeout(1200)]

RUNS, BEFORE, UNTIL = 300, 25, 55


def first_seen(name, **kwargs):
    """Return in how many courses a code came up, and after how many changes at the median."""
    tools = kwargs.get("tools", 1)
    seen, delays = Counter[str](), dict[str, list[int]]()
    for run in range(RUNS):
        changes, codes = course(f"{name}{run}", UNTIL, **kwargs), dict[str, int]()
        for count in range(BEFORE + 1, UNTIL + 1):
            for code in found(changes[: count * tools]):
                codes.setdefault(code, count - BEFORE)
        seen.update(codes.keys())
        for code, delay in codes.items():
            delays.setdefault(code, []).append(delay)
    shown = {code: (seen[code] / RUNS, median(delays[code])) for code in seen}
    print(f"\n{name}: share of courses, median delay in changes: {shown}")  # noqa: T201
    return shown


def moved(mm):
    return lambda index, tool: (mm * (index >= BEFORE and tool == 1), 0.0, 0.0)


@pytest.mark.parametrize("each_nozzle", [1, 5])
def test_false_alarms_of_a_steady_cell(each_nozzle):
    shown = first_seen(f"steady, {each_nozzle} measurements a nozzle", each_nozzle=each_nozzle)
    assert shown.get("unusual_change", (0,))[0] < 0.15
    for code in shown.keys() - {"unusual_change"}:
        assert shown[code][0] < 0.08, code


@pytest.mark.parametrize("sigmas", [1, 2, 3, 5])
def test_a_mount_that_slips(sigmas):
    shown = first_seen(f"mount slips by {sigmas} sigma", shift=moved(sigmas * 0.0206))
    if sigmas >= 3:
        assert shown["mount_shifted"][0] > 0.9


@pytest.mark.parametrize("sigmas", [3, 5])
def test_a_pin_that_moves(sigmas):
    pin = lambda index: sigmas * 0.005 * (index >= BEFORE)  # noqa: E731
    shown = first_seen(f"pin moves by {sigmas} sigma", pin=pin, shift=steady)
    assert shown["pin_moved"][0] > 0.9
