"""Whether the record says how well a stored Z is known: only a measurement of it does."""

from dataclasses import replace
from typing import Any

import pytest

from robolink.methods.one_touch.solvers import find_stored_z
from robolink.model import EntryKind, NewEntry, ToolOffset, plain_offset
from robolink.testing import MemoryController

OLD = ToolOffset(12.0, -4.0, -20.0)
MEASURED = replace(OLD, z_mm=-20.4)


@pytest.fixture
def log(request):
    with MemoryController(identity=request.node.name) as controller:
        yield Log(controller)


class Log:
    """Puts calibrations and writes on record, the oldest first."""

    def __init__(self, controller):
        self.controller, self._count = controller, 0

    def calibrated(self, before, value, *, measured, z_from, half=0.02, tip=None, **more: Any):
        self._count += 1
        change = f"c{self._count}"
        of_measurement = more.pop("of_measurement", {})
        self.controller.outcomes.append(
            NewEntry(
                EntryKind.CALIBRATION, change=change, tool=1,
                details={"measured": measured, "half_width95": [half] * len(measured)}
                | of_measurement,
            ),
            NewEntry(
                EntryKind.DONE, change=change, tool=1,
                details={"before": plain_offset(before), "value": plain_offset(value),
                         "tip": plain_offset(tip or value), "method": "m", "z_from": z_from}
                | more,
            ),
        )  # fmt: skip

    def typed(self, before, value):
        details = {"before": plain_offset(before), "value": plain_offset(value)}
        self.controller.outcomes.append(NewEntry(EntryKind.DONE, tool=1, details=details))

    def half_of(self, value):
        return find_stored_z(self.controller, 1, value).half95_mm


Z = ["z_mm"]
XY = ["x_mm", "y_mm"]
ASIDE = replace(MEASURED, x_mm=12.3)


def test_z_that_was_measured_has_the_interval_of_then(log):
    assert log.half_of(MEASURED) is None
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured")
    assert log.half_of(MEASURED) == 0.02
    # A value that is not that one has nothing to do with it.
    assert log.half_of(OLD) is None


@pytest.mark.parametrize(
    ("more", "half"),
    [
        ({"z_from": "kept"}, None),  # of another needle, for all that is known
        ({"z_from": "kept", "nozzle": "N-1"}, 0.02),  # the same needle
        ({"z_from": "kept", "nozzle": "N-2"}, None),
        ({"z_from": "measured", "length_checked": {"u_mm": 0.01}}, (0.02**2 + 0.0196**2) ** 0.5),
    ],
)
def test_z_that_was_kept_is_known_where_the_needle_or_the_heights_are_the_same(log, more, half):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured", nozzle="N-1")
    log.calibrated(MEASURED, ASIDE, measured=XY, **more)
    assert log.half_of(ASIDE) == (None if half is None else pytest.approx(half, rel=1e-3))


@pytest.mark.parametrize("aside_mm", [-0.3, 0.3])
def test_a_z_that_was_kept_has_to_be_the_one_that_was_measured(log, aside_mm):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured", nozzle="N-1")
    shifted = replace(ASIDE, z_mm=MEASURED.z_mm + aside_mm)
    log.calibrated(shifted, shifted, measured=XY, z_from="kept", nozzle="N-1")
    assert log.half_of(shifted) is None


def test_x_and_y_that_were_typed_leave_z_as_known_as_it_was(log):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured")
    log.typed(MEASURED, ASIDE)
    assert log.half_of(ASIDE) == 0.02


def test_a_z_that_was_typed_or_is_no_tip_is_not_known(log):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured")
    other = replace(MEASURED, z_mm=-21.0)
    log.typed(MEASURED, other)
    assert log.half_of(other) is None
    # A value by difference stands aside of where the tip was found.
    log.calibrated(other, OLD, measured=Z, z_from="measured", tip=MEASURED)
    assert log.half_of(OLD) is None
    # Without an interval there is none to go back to.
    log.calibrated(
        OLD, MEASURED, measured=Z, z_from="measured", of_measurement={"half_width95": []}
    )
    assert log.half_of(MEASURED) is None


def test_changes_by_one_touch_go_back_to_where_they_began(log):
    log.calibrated(OLD, MEASURED, measured=Z, z_from="measured")
    stored = {"value_mm": -20.4, "half95_mm": 0.02, "entry": 1}
    longer = replace(MEASURED, z_mm=-20.6)
    log.calibrated(
        MEASURED, longer, measured=[*XY, *Z], z_from="measured", half=0.05,
        of_measurement={"stored_z": stored},
    )  # fmt: skip
    found = find_stored_z(log.controller, 1, longer)
    assert (found.half95_mm, found.entry) == (0.02, 1)
    # One whose Z was never measured says nothing, whatever follows.
    again = replace(longer, z_mm=-20.5)
    log.calibrated(
        longer, again, measured=XY, z_from="kept",
        of_measurement={"changed": ["z_mm"], "stored_z": stored | {"half95_mm": None}},
    )  # fmt: skip
    assert log.half_of(again) is None
