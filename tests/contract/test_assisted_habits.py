"""The habits of a simulated person reach the calibration that they answer for, by --assist."""

import json

import pytest
from robolink_cli import main
from robolink_simulators.hosting.in_process import epson, softmotion

HOSTS = {"epson": epson, "softmotion": softmotion}
BIAS_MM = 0.2


@pytest.fixture(params=HOSTS)
def named(request):
    """Yield a sim URL without options, and the simulator behind it once it is there."""
    kind, name = request.param, f"assisted-habits-{request.param}"
    yield f"{kind}+sim://{name}", lambda: HOSTS[kind].simulator_named(name)
    HOSTS[kind].unregister(name)


def test_a_side_fixed_in_the_tool_is_what_the_offset_is_wrong_by(named, capsys):
    # A bias that turns with the tool looks like another tool to every touch, so nothing can tell.
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
