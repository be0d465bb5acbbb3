"""``--report`` of ``impact`` and ``calibrate``: the page is written however the run ends."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.control.assist import serve_assist
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.model import Pose, ToolOffset

STORED = ToolOffset(12.0, -3.5, -20.0)
POSES = ("--pose", "287.7,103.9,0", "--pose", "312.3,96.1,180")
FROM_POSES = ("calibrate", "two-pose", "--tool", "1", *POSES, "--impact", "1-5")


@pytest.fixture(autouse=True)
def plain_environment(tmp_path, monkeypatch):
    monkeypatch.delenv("ROBOLINK_PASSWORD", raising=False)
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def simulator():
    simulator = EpsonSimulator(seed=7, serial="SIM00001")
    simulator.machine.points.store(1, Point.at(Pose(250, 200, -30, 0)))
    simulator.machine.points.store(3, Point.at(Pose(250, 210, -30, 90)))
    return simulator


@pytest.fixture
def command(simulator, serve_simulator, capsys):
    url = serve_simulator(simulator).url

    def run(*words):
        capsys.readouterr()
        code = main.run(["-c", url, *words])
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return run


def page_of(path):
    return path.read_text(encoding="utf-8")


def check_numbers(page, impact):
    for entry in impact["points"]:
        for key, value in entry.items():
            if key != "point":
                assert f'<data value="{float(value)!r}">' in page
    assert "At every point: " in page
    assert ", largest" not in page


def test_an_impact_is_reported_with_the_numbers_of_its_document(command, tmp_path):
    words = ("impact", "--tool", "1", "--x", "12.3", "--y", "-3.9", "--points", "1-5")
    code, out, err = command(*words, "--report", "page.html", "--json")
    document, page = json.loads(out), page_of(tmp_path / "page.html")
    assert (code, document["report"], document["simulated"]) == (0, "page.html", True)
    assert "Report: page.html" in err
    check_numbers(page, document)
    for said in ("A proposal, nothing was written", "T6-602S", "SIM00001", "typed"):
        assert said in page
    assert "Not taught, skipped: 3." in page


def test_without_report_no_page_is_written_and_the_document_says_so(command, tmp_path):
    words = ("impact", "--tool", "1", "--x", "12.3", "--points", "1-5")
    assert json.loads(command(*words, "--json")[1])["report"] is None
    assert [*tmp_path.glob("*.html")] == []


def test_a_write_from_poses_is_reported(command, tmp_path):
    code, out, _ = command(*FROM_POSES, "--yes", "--report", "page.html", "--json")
    document, page = json.loads(out), page_of(tmp_path / "page.html")
    assert (code, document["report"]) == (0, "page.html")
    check_numbers(page, document["impact"])
    written = document["write"]["read_back"]
    for value in [*document["before"].values(), *written.values()]:
        assert f'<data value="{float(value)!r}">' in page
    assert "Written and read back, not tested" in page
    assert "There was no turn test of the new tip." in page
    assert "typed poses; taught with tool 0" in page
    # As on the journal's page.
    for said in ("Entries of the journal", "done by", "Limits and verdicts", "report number"):
        assert said in page


ENDS = {
    "declined": ((), 9, "Declined, nothing was written"),
    "implausible": (("--yes", "--max-change", "0.01"), 7, "Refused, nothing was written"),
    "dry run": (("--dry-run",), 0, "A proposal, nothing was written"),
}


@pytest.mark.parametrize("name", ENDS)
def test_a_page_says_that_nothing_was_written_and_why(command, simulator, tmp_path, name):
    words, code, verdict = ENDS[name]
    found, _, err = command(*FROM_POSES, *words, "--report", "page.html")
    page = page_of(tmp_path / "page.html")
    assert found == code
    assert verdict in page
    assert "SIMULATED: these results come from a simulator" in page
    assert "Report: page.html" in err
    assert simulator.machine.tools.get(1) == STORED
    if code:
        assert err.partition("robolink: ")[2].splitlines()[0] in page


def test_without_a_proposal_there_is_no_page(command, tmp_path):
    words = ("calibrate", "two-pose", "--tool", "1", "--points", "901,902", "--yes")
    assert command(*words, "--report", "page.html")[0] == 7
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize(
    "words",
    [
        (*FROM_POSES, "--yes"),
        ("impact", "--tool", "1", "--x", "13", "--points", "1"),
    ],
    ids=lambda words: words[0],
)
def test_a_page_that_is_there_is_kept_unless_forced(command, simulator, tmp_path, words):
    (tmp_path / "page.html").write_text("mine")
    sent = simulator.exchanges
    code, _, err = command(*words, "--report", "page.html")
    assert (code, simulator.exchanges) == (2, sent)
    assert "--force" in err
    assert page_of(tmp_path / "page.html") == "mine"
    assert command(*words, "--report", "page.html", "--force")[0] == 0
    assert page_of(tmp_path / "page.html").startswith("<!DOCTYPE html>")


@pytest.mark.parametrize(
    "words",
    [
        (*FROM_POSES, "--yes", "--force"),
        (*FROM_POSES, "--yes", "--report", "missing/page.html"),
        ("calibrate", "two-pose", "--tool", "1", "--dry-run", "--report", "page.html"),
    ],
    ids=lambda words: " ".join(words[-2:]),
)
def test_a_report_that_cannot_be_is_a_mistake_in_the_command(command, simulator, words):
    sent = simulator.exchanges
    assert command(*words)[0] == 2
    assert simulator.exchanges == sent


def test_a_page_that_cannot_be_saved_changes_nothing_about_the_end(
    command, simulator, tmp_path, monkeypatch
):
    def fill_the_disk(*_arguments, **_options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("robolink.files.named.write_whole", fill_the_disk)
    code, out, err = command(*FROM_POSES, "--yes", "--report", "page.html", "--json")
    document = json.loads(out)
    assert (code, document["report"], document["simulated"]) == (0, None, True)
    assert "cannot be written: No space left on device" in err
    assert simulator.machine.tools.get(1) != STORED


def live(simulator, capsys, *words):
    clock = ScaledClock(40)
    with serve_tcp(simulator, clock=clock) as host, serve_assist(simulator, clock=clock) as assist:
        assert main.run(["-c", host.url, "motors", "on", "--yes"]) == 0
        capsys.readouterr()
        more = ("--assist", assist.url, "--impact", "1-5", "--report", "page.html", "--yes")
        code = main.run(
            ["-c", host.url, "calibrate", "two-pose", "--tool", "1", *more, *words, "--json"]
        )
    return code, json.loads(capsys.readouterr().out)


def test_a_live_calibration_is_reported_with_its_drifts(simulator, capsys, tmp_path):
    code, document = live(simulator, capsys)
    page = page_of(tmp_path / "page.html")
    assert (code, document["report"]) == (0, "page.html")
    check_numbers(page, document["impact"])
    assert document["source"] == {"kind": "live"}
    before, after = document["before"], document["proposed"]
    entry = next(one for one in document["impact"]["points"] if one["point"] == 1)
    assert entry["dx_mm"] == pytest.approx(before["x_mm"] - after["x_mm"])
    assert entry["dy_mm"] == pytest.approx(before["y_mm"] - after["y_mm"])
    assert "Written, read back and tested" in page
    assert "journal entries were checked when this page was made" in page
    for drift in document["verification"]["drifts"]:
        assert f'<data value="{drift["distance_mm"]!r}">' in page


def test_a_failed_verification_is_reported_with_its_drifts(simulator, capsys, tmp_path):
    code, document = live(simulator, capsys, "--tolerance", "0.0001")
    page = page_of(tmp_path / "page.html")
    assert (code, document["error"]["kind"]) == (8, "VerifyError")
    # So small a tolerance is below the scatter of the touches.
    verdict = "Not decided, which does not pass: "
    for said in ("The turn test failed", "is back.", verdict):
        assert said in page
