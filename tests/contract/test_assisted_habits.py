"""The habits of a simulated person affect the calibration run with --assist."""

import json
import random

import pytest
from robolink_cli import main
from robolink_simulators.hosting.in_process import epson, softmotion

from robolink import runtime
from robolink.runtime import SystemRuntime


class SameChance(SystemRuntime):
    """Draws the places beside the pin alike in each run: a side shows only in enough of them, and
    one run in eight draws others.
    """

    def __init__(self):
        self._random = random.Random(11)

    def random_bytes(self, count):
        return self._random.randbytes(count)


HOSTS = {"epson": epson, "softmotion": softmotion}
BIAS_MM = 0.2


@pytest.fixture
def named(kind):
    """Yield a sim URL without options, and the simulator behind it once it is there."""
    name = f"assisted-habits-{kind}"
    yield f"{kind}+sim://{name}", lambda: HOSTS[kind].simulator_named(name)
    HOSTS[kind].unregister(name)


@pytest.mark.parametrize("kind", [pytest.param("epson", marks=pytest.mark.soak), "softmotion"])
def test_a_side_fixed_in_the_tool_is_what_the_offset_is_wrong_by(named, capsys):
    # A bias that turns with the tool looks like another tool at every touch: undetectable.
    bare, simulator = named
    habits = {
        "eye_sigma_mm": 0,
        "person_bias_mm": BIAS_MM,
        "person_bias_frame": "tool",
        "person_bias_toward_deg": 90,
    }
    url = f"{bare}?seed=3&" + "&".join(f"world.{name}={value}" for name, value in habits.items())
    words = ("calibrate", "two-pose", "--tool", "1", "--assist", bare, "--yes", "--json")
    assert main.run(["-c", url, *words, "--speed", "100"]) == 0
    found, truth = json.loads(capsys.readouterr().out)["proposed"], simulator().world.tips[1]
    assert found["x_mm"] - truth.x_mm == pytest.approx(0.0, abs=0.03)
    assert found["y_mm"] - truth.y_mm == pytest.approx(-BIAS_MM, abs=0.03)
    assert simulator().world.operator.touches >= 3


@pytest.mark.parametrize("kind", ["epson", pytest.param("softmotion", marks=pytest.mark.soak)])
@pytest.mark.parametrize("frame", ["approach", "base"])
def test_a_side_from_which_the_tip_comes_is_told_with_its_size(named, capsys, frame):
    # A bias that is fixed in the base shifts the pin that is found, but no tip.
    bare, simulator = named
    habits = {"eye_sigma_mm": 0.005, "person_bias_mm": 0.05, "person_bias_frame": frame}
    url = f"{bare}?seed=5&" + "&".join(f"world.{name}={value}" for name, value in habits.items())
    words = ("calibrate", "n-angle", "--tool", "1", "--count", "8", "--assist", bare)
    more = ("--yes", "--json", "--no-verify", "--speed", "100")
    with runtime.replaced(SameChance()):
        assert main.run(["-c", url, *words, *more]) == 0
    document = json.loads(capsys.readouterr().out)
    truly_mm = 0.05 if frame == "approach" else 0.0
    assert ("approach_bias" in document["warnings"]) is (frame == "approach")
    found_mm = document["fit"]["evidence"]["approach_bias_mm"]
    assert found_mm == pytest.approx(truly_mm, abs=0.025)
    assert document["proposed"]["x_mm"] == pytest.approx(simulator().world.tips[1].x_mm, abs=0.05)
