"""station learn CAMERA: a person confirms one picture, a small movement shows how late it is."""

import json
import math
from dataclasses import replace

import pytest
from robolink_cli import main
from robolink_cli.console.person import Person, person_at
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process.epson import register, unregister
from robolink_simulators.pictures.camera import DrawnCamera
from robolink_simulators.pictures.server import PictureServer

import robolink
from robolink.journal import default_location, may_exist, open_journal
from robolink.model import EntryKind, MotionProfile, Path, WorkBox
from robolink.runner import Runner

CELL = """
[cells.line3]
url = "{url}"
tool = 1
remote_timeout_s = 60.0
remote_timeout_confirmed_by = "a test"
[cells.line3.stations.CAM-01]
kind = "camera"
{sensor}
x_mm = {x}
y_mm = {y}
z_mm = {z}
{more}
"""

pytestmark = [pytest.mark.simulator_only, pytest.mark.timeout(120)]


@pytest.fixture
def bench(tmp_path, monkeypatch, capsys):
    """A simulated robot with its tip over a drawn camera, and its cell file."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    simulator = EpsonSimulator("T6-602S", seed=3, serial="SIM00031")
    simulator.durable = True
    camera = simulator.world.camera
    # A quarter of the pixels, so that a picture takes a quarter of the time.
    simulator.world.camera = replace(camera, optics=replace(camera.optics, size_px=(640, 512)))
    register("learning", simulator)
    with PictureServer(DrawnCamera(simulator)) as server:
        yield Bench(simulator, server, tmp_path, capsys)
    unregister("learning")


class Bench:
    def __init__(self, simulator, server, folder, capsys):
        self.simulator, self.server, self.folder, self.capsys = simulator, server, folder, capsys
        self.write()

    def write(self, more="diameter_mm = 1.0", *, sensor=True):
        x, y, z = self.simulator.world.camera.middle_mm
        named = f'sensor = "{self.server.url("pgm")}"' if sensor else ""
        text = CELL.format(url=self.simulator.url, sensor=named, x=x, y=y, z=z, more=more)
        (self.folder / "robolink.toml").write_text(text, encoding="utf-8")

    def bring_tip(self):
        """Move the true tip of tool 1 to 0.2 mm from the middle of the picture."""
        tip = self.simulator.world.tips[1]
        x_mm, y_mm, z_mm = self.simulator.world.camera.middle_mm
        with robolink.connect(self.simulator.url, remote_timeout_s=60) as controller:
            controller.tools.select(0)
            group = controller.groups[0]
            here = group.pose()
            turn = math.radians(here.u_deg)
            dx = math.cos(turn) * tip.x_mm - math.sin(turn) * tip.y_mm
            dy = math.sin(turn) * tip.x_mm + math.cos(turn) * tip.y_mm
            target = replace(here, x_mm=x_mm + 0.2 - dx, y_mm=y_mm - 0.1 - dy, z_mm=z_mm - tip.z_mm)
            group.move_to(target, MotionProfile(Path.STRAIGHT, speed_mm_s=50), box=WorkBox()).wait(
                timeout_s=60
            )
            controller.tools.select(1)

    def faulty(self, **parameters):
        """Let something be wrong with the pictures from now on."""
        world = self.simulator.world
        world.set_up(replace(world.parameters, **parameters))

    def flange(self):
        pose = self.simulator.world.robot.flange()
        return pose.x_mm, pose.y_mm, pose.z_mm, pose.u_deg

    def stored(self):
        with robolink.connect(self.simulator.url) as controller:
            return controller.tools.read(1)

    def run(self, *words):
        code = main.run(["-c", "line3", *words])
        shown = self.capsys.readouterr()
        return code, shown.out, shown.err

    def learn(self, *words):
        return self.run("cell", "station", "learn", "CAM-01", "--tool", "1", *words, "--json")

    def assisted(self, *words):
        self.bring_tip()
        return self.learn("--assist", self.simulator.url, "--yes", *words)

    def entries(self):
        if not may_exist(default_location()):
            return []
        journal = open_journal(read_only=True)
        return list(journal.entries(kinds=(EntryKind.STATION,)))


def test_a_camera_is_taught_and_keeps_it(bench):
    bench.bring_tip()
    before, stored = bench.flange(), bench.stored()
    code, out, err = bench.learn("--assist", bench.simulator.url, "--yes")
    assert code == 0, err
    assert bench.stored() == stored  # no tool is written
    details = json.loads(out)["details"]
    um_per_px = bench.simulator.world.parameters.camera_um_per_px_x
    assert details["radius_px"] == pytest.approx(500 / um_per_px, rel=0.06)
    assert details["bore_ratio"] == pytest.approx(0.5, abs=0.1)
    assert details["lag_s"] < 0.5
    assert details["lag_pictures"] == 0
    assert bench.flange() == pytest.approx(before, abs=0.01)
    page = (bench.folder / "CAM-01.html").read_text(encoding="utf-8")
    assert "<circle" in page
    code, out, _ = bench.run("cell", "station", "show", "CAM-01")
    assert f"radius_px = {details['radius_px']:g}" in out
    assert "taught = " in out


def test_without_a_person_nothing_is_taught_whatever_was_said_yes_to(bench):
    code, out, _ = bench.learn("--yes")
    assert (code, json.loads(out)["error"]["kind"]) == (9, "DeclinedError")
    assert bench.entries() == []
    assert bench.server.requests == 0


@pytest.mark.soak
def test_without_a_movement_the_lag_stays_unknown(bench):
    bench.bring_tip()
    code, out, err = bench.learn("--assist", bench.simulator.url)
    assert code == 0, err
    details = json.loads(out)["details"]
    assert "lag_s" not in details
    assert details["radius_px"] > 10
    assert "unknown how late" in err


@pytest.mark.soak
def test_a_person_who_does_not_confirm_teaches_nothing(bench, monkeypatch):
    monkeypatch.setattr(Runner, "confirm", lambda self, question: False)
    monkeypatch.setattr(Runner, "choose", lambda self, question, offered: 0)
    bench.bring_tip()
    before = bench.flange()
    with person_at(Person.TERMINAL):
        code, _, _ = bench.learn("--yes")
    assert code == 9
    assert bench.entries() == []
    assert bench.flange() == before


@pytest.mark.soak  # a picture that never changes is waited for
@pytest.mark.parametrize("stuck", ["same", "noisy"])
def test_pictures_that_stand_still_are_refused_before_anything_is_recorded(bench, stuck):
    bench.faulty(picture_stuck=stuck, picture_faults_from=2)
    bench.bring_tip()
    before = bench.flange()
    code, out, _ = bench.learn("--assist", bench.simulator.url, "--yes")
    expected = {"same": "stale_picture", "noisy": "tip_did_not_move"}[stuck]
    assert (code, json.loads(out)["error"]["code"]) == (7, expected)
    assert bench.entries() == []
    assert bench.flange() == pytest.approx(before, abs=0.01)


@pytest.mark.soak
def test_pictures_that_are_late_by_their_number_are_learnt_as_such(bench):
    bench.faulty(picture_late=2)
    code, out, err = bench.assisted()
    assert code == 0, err
    details = json.loads(out)["details"]
    assert details["lag_pictures"] == 2


@pytest.mark.soak
def test_a_reflection_with_a_bore_that_is_confirmed_does_not_move(bench):
    bench.faulty(picture_fleck="tip", picture_tip_hidden=True)
    code, out, _ = bench.assisted()
    assert (code, json.loads(out)["error"]["code"]) == (7, "tip_did_not_move")
    assert bench.entries() == []


@pytest.mark.soak
def test_a_diameter_that_the_movement_contradicts_is_refused(bench):
    bench.write("diameter_mm = 2.0")
    bench.bring_tip()
    before = bench.flange()
    code, out, _ = bench.learn("--assist", bench.simulator.url, "--yes")
    assert (code, json.loads(out)["error"]["code"]) == (7, "spot_changed")
    assert bench.entries() == []
    assert bench.flange() == pytest.approx(before, abs=0.01)


@pytest.mark.soak
def test_a_tip_that_is_not_there_is_not_taught(bench):
    """What is left in the picture is offered, and nobody takes it for a tip."""
    bench.faulty(picture_tip_hidden=True)
    code, _, _ = bench.assisted()
    assert code in (7, 9)
    assert bench.entries() == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--sigma", "0.1"], "for pins"),
        (["--contact-input", "3"], "for pins"),
        (["--picture", "look.jpg"], ".html or .png"),
    ],
)
def test_options_of_pins_are_refused_for_a_camera(bench, words, said):
    code, out, _ = bench.learn("--yes", "--assist", bench.simulator.url, *words)
    assert code == 2
    error = json.loads(out)["error"]
    assert said in error["what"] + error["remedy"]
    assert bench.server.requests == 0


def test_a_station_without_a_camera_is_refused(bench):
    bench.write(sensor=False)
    code, out, _ = bench.learn("--yes", "--assist", bench.simulator.url)
    assert code == 2
    assert "which camera" in json.loads(out)["error"]["what"]


def test_a_pin_takes_no_picture(bench):
    code, _, err = bench.run(
        "cell", "station", "learn", "PIN-X", "--tool", "1", "--picture", "a.html", "--yes"
    )
    assert code == 2
    assert "--picture is for cameras" in err


def test_the_plan_is_shown_and_nothing_is_sent_or_taken(bench):
    code, out, _ = bench.learn("--dry-run")
    document = json.loads(out)
    assert code == 0
    assert len(document["steps"]) == 2
    assert bench.server.requests == 0
    assert bench.entries() == []
