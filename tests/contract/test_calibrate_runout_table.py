"""A nozzle with spindle runout, measured all round by a camera, on both kinds of controllers."""

import math

import pytest

from robolink.calibration import RunoutTableResult
from robolink.methods import AllRoundPlan, CameraSource, RunoutTableSource
from robolink.model import ToolOffset
from tests.contract._camera_cell import camera_station, cell_of, furnish, run_source
from tests.contract._sensor_cell import miss_mm

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]

ALL_ROUND = AllRoundPlan(turns_deg=tuple(30.0 * step for step in range(12)))
WOBBLE_MM, TOWARD_DEG = 0.12, 40.0


@pytest.mark.parametrize("kind", ["epson", pytest.param("softmotion", marks=pytest.mark.soak)])
def test_a_table_by_angle_is_found_and_the_proof_finds_the_tip_where_it_says(kind):
    with cell_of(kind) as cell:
        furnish(cell, wobble_mm=WOBBLE_MM, wobble_toward_deg=TOWARD_DEG)
        source = RunoutTableSource(cell.url, camera_station(cell), ALL_ROUND)
        report = run_source(cell, source)
        result = report.proposal.result
        assert isinstance(result, RunoutTableResult)
        assert miss_mm(result.offset, cell.truth) < 0.008
        assert result.wobble
        assert len(result.table.rows) == 12
        for row in result.table.rows:
            toward = math.radians(2 * row.u_deg + TOWARD_DEG)
            beside = ToolOffset(WOBBLE_MM * math.cos(toward), WOBBLE_MM * math.sin(toward))
            assert miss_mm(ToolOffset(row.dx_mm, row.dy_mm), beside) < 0.015
        # Interpolation between two rows leaves a seventh of the runout; without the table all of it
        # stays.
        assert report.verification.max_drift_mm < 0.04


def test_without_the_table_the_proof_finds_all_of_the_wobble():
    with cell_of("epson") as cell:
        furnish(cell, wobble_mm=WOBBLE_MM, wobble_toward_deg=TOWARD_DEG)
        report = run_source(cell, CameraSource(cell.url, camera_station(cell), ALL_ROUND))
        assert report.verification.max_drift_mm > 0.08
