"""A pin below the box: the calibration ends, whether a person or a stand-in answers."""

import pytest

from tests.contract._method_cell import KINDS, method_cell

pytestmark = pytest.mark.simulator_only


@pytest.mark.parametrize("kind", KINDS)
def test_a_stand_in_that_never_reaches_the_pin_ends_it_with_9(kind, tmp_path, monkeypatch):
    with method_cell(kind, tmp_path, monkeypatch) as cell:
        x_mm, y_mm, z_mm = cell.world.pin_mm
        cell.world.pin_mm = (x_mm, y_mm, z_mm - 400.0)
        before = cell.stored
        done = cell.calibrate("two-pose")
        assert done.code == 9, done.err
        said = done.document["error"]["what"]
        assert "10 jogs in a row were refused" in said
        assert "would leave the allowed area" in said
        assert cell.stored == before
        with cell.cell.connected() as controller:
            assert controller.tools.selected() == 1
            assert controller.outcomes.open_markers() == ()
