"""A tool that the kinematics cannot support is refused before the write, component by component."""

import sys
from pathlib import Path

import pytest
from robolink_cli import main
from robolink_simulators.hosting.in_process import softmotion
from robolink_simulators.softmotion.catalogue import NAMES, machine_named
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

import robolink
from robolink import ToolOffset
from robolink.controllers.softmotion.kinematics import (
    NoOrientationImageError,
    OrientationImages,
)
from robolink.errors import ConfigError, RejectedError
from robolink.protocols.mailbox import ErrorClass, Kinematics, find_kinematics
from tests.unit import test_sim_kinematics as own

BESIDE = ToolOffset(12.0, -3.5, -20.0)
ALONG = ToolOffset(0.0, 0.0, -21.5, 30.0)
EXAMPLES = Path(__file__).parents[2] / "examples"
HERE = own.__name__


@pytest.fixture
def machine():
    """Connects to a new simulated PLC by the name of its kinematics."""
    opened = []

    def connected(kinematics, *, named=False):
        if named:
            plc = robolink.connect(f"softmotion+sim://fits?kinematics={kinematics}")
            simulator = softmotion.simulator_named("fits")
        else:
            simulator = SoftMotionSimulator(kinematics)
            plc = robolink.connect(softmotion.register("fits", simulator))
        simulator.plc.memory.define(2, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), "earlier")
        opened.append(plc)
        return simulator, plc

    yield connected
    for plc in opened:
        plc.close()
    softmotion.unregister("fits")


def written(simulator):
    return [text for _, way, text in simulator.log if way == ">" and "WRITE" in text]


@pytest.mark.parametrize("name", NAMES)
def test_the_driver_and_the_simulator_say_the_same_of_every_kinematics(name):
    """Each has its own table; a fault in either would go unnoticed."""
    position, _, orientation = name.partition("+")
    space = OrientationImages().space(
        find_kinematics(position) or 0, (find_kinematics(orientation) or 0) if orientation else 0
    )
    kinematics = machine_named(name).kinematics
    simulated = kinematics.orientation_image(
        kinematics.flange((0.0,) * len(kinematics.kinds)).rotation
    )
    assert space is not None
    assert simulated is not None
    assert space.dof is simulated.dof
    for shift in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        assert space.accepts(shift) is simulated.accepts(shift)


@pytest.mark.parametrize("slot", [1, 3])
@pytest.mark.parametrize(
    ("kinematics", "offset", "says"),
    [
        ("Kin_Scara2_Z", BESIDE, "X 12.000 mm, Y -3.500 mm of its shift is impossible"),
        ("Kin_Polar", ToolOffset(0.0, 0.25, -20.0), ": Y 0.250 mm of"),
        ("Kin_Scara2_Z", ToolOffset(0.0, 0.0001, 0.0), "a part below 0.0005 mm"),
        ("Kin_Pos_RRR", ALONG, "Z -21.500 mm"),
    ],
)
def test_each_impossible_component_is_named_and_nothing_is_sent(
    machine, slot, kinematics, offset, says
):
    simulator, plc = machine(kinematics)
    before = plc.tools.read(slot)
    for attempt in (
        lambda: plc.tools.preview_write(slot, offset),
        lambda: plc.tools.write(slot, offset, expected=before),
    ):
        with pytest.raises(RejectedError, match=says) as refused:
            attempt()
        assert refused.value.code == ErrorClass.TOOL_INCOMPATIBLE
        assert kinematics in str(refused.value)
    assert not written(simulator)
    assert plc.tools.read(slot) == before


def test_what_fits_is_written_and_an_earlier_value_is_put_back_whatever_it_is(machine):
    _, plc = machine("Kin_Scara2_Z")
    plc.tools.write(1, ALONG, expected=plc.tools.read(1))
    assert plc.tools.same(plc.tools.read(1), ALONG)
    earlier = plc.tools.read(2)
    plc.tools.write(2, ALONG, expected=earlier)
    with pytest.raises(RejectedError, match="impossible"):
        plc.tools.write(2, earlier, expected=ALONG)
    with plc.latch.putting_back(2):
        plc.tools.write(2, earlier, expected=ALONG)
    assert plc.tools.read(2) == earlier


def test_a_slot_whose_tool_does_not_fit_is_not_selected(machine):
    simulator, plc = machine("Kin_Scara2_Z")
    with pytest.raises(RejectedError, match=r"X 1\.000 mm, Y 2\.000 mm"):
        plc.tools.select(2)
    assert not [text for _, _, text in simulator.log if "SELECT" in text]
    assert plc.tools.selected() == 1


@pytest.fixture
def example(monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES / "kinematics")
    yield "double_scara:DoubleScara"
    sys.modules.pop("double_scara", None)


def test_a_kinematics_of_one_s_own_that_is_named_is_judged_before_the_plc_is_asked(
    machine, example
):
    simulator, plc = machine(example, named=True)
    with pytest.raises(RejectedError, match=r"own kinematics .* X 12\.000 mm, Y -3\.500 mm"):
        plc.tools.write(3, BESIDE, expected=None)
    assert not written(simulator)
    plc.tools.write(3, ALONG, expected=None)


def test_one_that_nobody_has_named_is_judged_by_the_plc(machine, example):
    simulator, plc = machine(example)
    with pytest.raises(RejectedError, match="The PLC refused"):
        plc.tools.write(1, BESIDE, expected=plc.tools.read(1))
    assert written(simulator)


def test_one_without_an_orientation_image_takes_no_tool_at_all(machine):
    _, plc = machine(f"{HERE}:Rail", named=True)
    with pytest.raises(RejectedError, match="cannot carry tool offsets at all") as refused:
        plc.tools.write(3, ToolOffset(), expected=None)
    assert refused.value.code == ErrorClass.NO_ORIENTATION_IMAGE


@pytest.mark.parametrize(
    ("custom", "codes", "open_"),
    [
        ((own.Head(),), (Kinematics.GANTRY3, Kinematics.CUSTOM), 0),
        ((own.Head(),), (Kinematics.POS_RRR, Kinematics.CUSTOM), 3),
        ((own.MissingRail(),), (Kinematics.CUSTOM, 0), 1),
        ((), (Kinematics.CUSTOM, 0), None),
        ((), (Kinematics.GANTRY3, Kinematics.CUSTOM), None),
        ((), (99, 0), None),
        ((), (Kinematics.GANTRY3, 99), None),
    ],
)
def test_what_is_open_of_a_coupling_with_a_part_of_one_s_own(custom, codes, open_):
    space = OrientationImages(custom).space(*codes)
    assert (None if space is None else space.dof.value) == open_


def test_a_position_kinematics_of_one_s_own_needs_the_interface_to_carry_another():
    with pytest.raises(NoOrientationImageError):
        OrientationImages((own.MissingRail(),)).space(Kinematics.CUSTOM, Kinematics.C_AXIS)


def test_a_plc_is_not_told_which_kinematics_it_has():
    with pytest.raises(ConfigError, match="The PLC itself reports"):
        robolink.connect("softmotion+modbus-tcp://127.0.0.1:1?kinematics=Kin_Gantry3")


def test_a_command_says_it_and_sends_nothing(machine, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    simulator, plc = machine("Kin_Scara2_Z")
    plc.close()
    command = ("-c", "softmotion+sim://fits", "tool", "set", "3", "--x", "12", "--z", "-20")
    for more in ((), ("--dry-run",)):
        assert main.run([*command, *more]) == 5
        assert "X 12.000 mm of its shift is impossible" in capsys.readouterr().err
    assert not written(simulator)


@pytest.fixture
def run(machine, tmp_path, monkeypatch, capsys):
    """Run a command on a PLC whose flange turns with its arms; return code and messages."""
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    simulator, plc = machine("Kin_Scara2_Z")
    plc.close()

    def run(*words):
        code = main.run(["-c", "softmotion+sim://fits", *words])
        shown = capsys.readouterr()
        assert simulator.plc.group.movements_started == 0
        assert not written(simulator)
        return code, shown.out + shown.err

    return run


SCARA_PIN = str(EXAMPLES / "recipes" / "scara-pin.toml")


@pytest.mark.parametrize(
    "words",
    [
        ("recalibrate", SCARA_PIN, "--yes"),
        ("recalibrate", SCARA_PIN, "--dry-run"),
        ("calibrate", "two-pose", "--tool", "1", "--yes"),
    ],
)
def test_what_a_recipe_would_measure_in_vain_is_said_before_anything_moves(run, words):
    code, told = run(*words, "--assist", "softmotion+sim://fits")
    assert code == 5
    assert "Kin_Scara2_Z cannot store the measured values: X, Y." in told


@pytest.mark.parametrize(
    ("kinematics", "components"),
    [
        ("Kin_Scara2_Z", ("z_mm", "u_deg")),
        ("Kin_Gantry3+Kin_CAxis", ("x_mm", "y_mm", "z_mm")),
        ("Kin_Pos_RRR", ("u_deg",)),
    ],
)
def test_what_can_be_told_may_be_measured(machine, kinematics, components):
    _, plc = machine(kinematics)
    plc.tools.require_measurable(components)
