"""``pivot``, ``six-point`` and ``one-touch`` from taught poses; ``station learn``."""

import csv
from itertools import product

import numpy as np
import pytest

from robolink.calibration import rotation_of, uvw_deg
from robolink.model import EntryKind, Pose, ToolOffset
from tests.contract._method_cell import KINDS, method_cell

pytestmark = pytest.mark.simulator_only

PIN = np.array([300.0, 100.0, -60.0])
TIP = ToolOffset(12.4, -3.2, -20.5, 15.0, 8.0, -5.0)
TILTED = [Pose(0, 0, 0, u, v, w) for u, v, w in product((0, 120), (-25, 25), (-25, 25))]
COLUMNS = ("x_mm", "y_mm", "z_mm", "u_deg", "v_deg", "w_deg")


@pytest.fixture(params=KINDS)
def cell(request, tmp_path, monkeypatch):
    with method_cell(request.param, tmp_path, monkeypatch) as cell:
        yield cell


def touching(pose):
    """Return the flange's coordinates with the tip on the pin, in the orientation of ``pose``."""
    place = PIN - rotation_of(pose) @ TIP.components()[:3]
    return (*place.tolist(), *pose.coordinates()[3:])


def poses_file(path, rows, columns=COLUMNS):
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(columns)
        table.writerows(row[: len(columns)] for row in rows)
    return str(path)


def six_points():
    """Return pivot poses and the two moves along the tool's own axes."""
    rows = [touching(pose) for pose in TILTED]
    last = TILTED[-1]
    axes = rotation_of(last) @ rotation_of(Pose(0, 0, 0, *TIP.components()[3:]))
    for axis in (0, 2):
        moved = np.array(rows[len(TILTED) - 1][:3]) + 50.0 * axes[:, axis]
        rows.append((*moved.tolist(), *last.coordinates()[3:]))
    return rows


def test_a_pivot_from_a_file_gives_all_lengths_and_finds_the_pin(cell, tmp_path):
    path = poses_file(tmp_path / "poses.csv", [touching(pose) for pose in TILTED])
    words = ("calibrate", "pivot", "--tool", "1", "--poses", path, "--station", "PIN-07")
    done = cell.run(*words, "--yes", "--json")
    assert done.code == 0, done.err
    document = done.document
    assert document["measured"] == ["x_mm", "y_mm", "z_mm"]
    assert cell.stored.components()[:3] == pytest.approx(TIP.components()[:3], abs=1e-3)
    found = cell.recorded(EntryKind.STATION)[0].details
    assert [found[name] for name in COLUMNS[:3]] == pytest.approx(PIN.tolist(), abs=1e-3)


def test_six_points_give_the_orientation_where_the_controller_can_hold_it(cell, tmp_path):
    path = poses_file(tmp_path / "poses.csv", six_points())
    done = cell.run("calibrate", "six-point", "--tool", "3", "--poses", path, "--yes", "--json")
    if hasattr(cell.cell.simulator, "machine"):
        # A SCARA holds no V and W: the driver says so and sends nothing.
        assert done.code == 5, done.err
        assert cell.held(3) is None
        return
    assert done.code == 0, done.err
    held = cell.held(3)
    assert held.components()[:3] == pytest.approx(TIP.components()[:3], abs=1e-6)
    turned = rotation_of(Pose(0, 0, 0, *held.components()[3:]))
    assert uvw_deg(turned) == pytest.approx(TIP.components()[3:], abs=1e-6)


@pytest.mark.parametrize(
    ("method", "rows", "columns", "code", "named"),
    [
        ("pivot", [touching(pose) for pose in TILTED[:2]], COLUMNS, 7, "too_few_poses"),
        ("pivot", [touching(Pose(0, 0, 0, u)) for u in (0, 90, 180)], COLUMNS, 7, "rank_deficient"),
        ("pivot", [touching(pose) for pose in TILTED], COLUMNS[:4], 2, "there is no V, W"),
        ("six-point", six_points()[-4:], COLUMNS, 7, "too_few_poses"),
        ("six-point", [touching(pose) for pose in TILTED], COLUMNS, 7, "turned_on_the_way"),
        ("n-angle", [touching(Pose(0, 0, 0, u)) for u in (0, 5, 10)], COLUMNS, 7, "insufficient"),
        ("n-angle", [touching(Pose(0, 0, 0, u)) for u in (0, 0, 0)], COLUMNS, 7, "degenerate"),
        ("n-angle", [touching(pose) for pose in TILTED], COLUMNS, 7, "tilted_pose"),
    ],
)
def test_poses_that_tell_nothing_are_refused_by_name(
    tmp_path, monkeypatch, method, rows, columns, code, named
):
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        path = poses_file(tmp_path / "poses.csv", rows, columns)
        words = ("calibrate", method, "--tool", "1", "--poses", path)
        refused = cell.run(*words, "--yes", "--json")
        assert refused.code == code, refused.err
        error = refused.document["error"]
        assert (error["code"] or "").startswith(named) or named in error["what"]
        assert cell.stored == ToolOffset(12.0, -3.5, -20.0)


def test_one_touch_may_be_taught_too(tmp_path, monkeypatch):
    with method_cell("epson", tmp_path, monkeypatch) as cell:
        flat = [Pose(0, 0, 0, u) for u in (0, 90, 180, -90)]
        path = poses_file(tmp_path / "poses.csv", [touching(pose) for pose in flat])
        at = ("--tool", "1", "--station", "PIN-07", "--yes", "--json")
        assert cell.run("calibrate", "n-angle", "--poses", path, *at).code == 0
        x, y, z = touching(flat[1])[:3]
        typed = f"{x + 0.2},{y},{z + 0.3},90"
        done = cell.run("calibrate", "one-touch", "--pose", typed, "--sigma", "0.01", *at)
        assert done.code == 0, done.err
        # At U 90 the base's X is the flange's -Y; the higher the flange, the longer the tip.
        change = [b - a for a, b in zip(TIP.components(), cell.stored.components(), strict=True)]
        assert change[:2] == pytest.approx([0.0, 0.2], abs=2e-3)
        three = cell.run("calibrate", "one-touch", "--pose", "1,2,90", *at)
        assert three.code == 2
        assert "X,Y,Z,U" in three.document["error"]["remedy"]


@pytest.mark.parametrize(
    ("cell", "name"),
    # Tracing beams is the same on every kind, and slow on a PLC.
    [
        ("epson", "PIN-07"),
        # With what was learnt of them in test_station_uncertainty.py.
        pytest.param("epson", "BEAMS-02", marks=pytest.mark.soak),
        pytest.param("epson", "PLATE", marks=pytest.mark.soak),
        pytest.param("plc", "PIN-07", marks=pytest.mark.soak),
        ("plc", "PLATE"),
    ],
    indirect=["cell"],
)
def test_a_station_is_learnt_with_a_tip_that_is_known(cell, name):
    cell.mount()
    with cell.cell.connected() as controller:
        controller.tools.write(1, cell.truth, expected=controller.tools.read(1))
    words = ("station", "learn", name, "--tool", "1", "--speed", "100")
    shown = cell.run(*words, "--dry-run", "--json")
    assert shown.code == 0, shown.err
    assert cell.recorded(EntryKind.STATION) == []
    assert cell.run(*words).code == 9
    done = cell.run(*words, "--assist", cell.cell.url, "--yes", "--json")
    assert done.code == 0, done.err
    document = done.document
    if name == "PIN-07":
        place = [document[key] for key in COLUMNS[:3]]
        assert place == pytest.approx(cell.world.pin_mm, abs=0.05)
        assert document["gauge"] == "G-123"
    elif name == "PLATE":
        assert document["z_mm"] == pytest.approx(cell.cell.plate.z_mm, abs=0.02)
    else:
        for line, heading in zip(document["details"]["beams"], (3.0, 88.0), strict=True):
            assert line["direction_deg"] == pytest.approx(heading, abs=0.2)
    assert cell.run("calibrate", "one-touch", "--tool", "1", "--station", "X").code == 2
