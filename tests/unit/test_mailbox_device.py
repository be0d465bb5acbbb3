"""A PLC's once-drawn number, and its angles: the same rotation as EPSON's."""

import json
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from robolink_simulators.softmotion.mailbox import MailboxOptions, PlcOptions, SoftMotionSimulator
from robolink_simulators.softmotion.mailbox.option_text import options_from_text
from scipy.spatial.transform import Rotation

from robolink.controllers import read_device_id
from robolink.errors import ConfigError, RejectedError
from robolink.model import ToolOffset
from robolink.protocols.mailbox import (
    DEVICE_START,
    BlockError,
    decode_device_id,
    encode_device_id,
    frames_match,
    from_frame,
    to_frame,
)
from tests._rows import each_row
from tests.unit._mailbox_client import linked
from tests.unit.softmotion_driver._cell import Cell

# The number that a PLC draws once: as words, in a simulator, and read by the driver.


@pytest.fixture
def cell():
    cell = Cell()
    yield cell
    cell.close()


def plc(state_path=None, **options):
    mailbox = MailboxOptions(**options)
    return SoftMotionSimulator(options=PlcOptions(mailbox=mailbox), state_path=state_path)


def number_of(simulator):
    return read_device_id(linked(simulator).link)


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.parametrize("device_id", [1, 0xFFFF, 0x10000, 0x1234_BEEF, 0xFFFF_FFFF])
def test_a_number_goes_into_four_words_and_comes_back(device_id):
    words = encode_device_id(device_id)
    assert words[:2] == (device_id & 0xFFFF, device_id >> 16)
    assert all(word ^ other == 0xFFFF for word, other in zip(words[:2], words[2:], strict=True))
    assert decode_device_id(words) == device_id


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.parametrize("device_id", [0, -1, 2**32])
def test_what_is_no_number_of_a_plc_is_not_encoded(device_id):
    with pytest.raises(BlockError):
        encode_device_id(device_id)


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.parametrize(
    "words",
    [
        (0, 0, 0, 0),
        (0, 0, 0xFFFF, 0xFFFF),
        (7, 7, 7, 7),
        (0xBEEF, 0x1234, 0x4110, 0xEDCA),
        (0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF),
    ],
)
def test_words_that_do_not_belong_together_are_no_number(words):
    assert decode_device_id(words) is None


@pytest.mark.usefixtures("mailbox_program")
def test_two_simulators_have_two_numbers_though_they_share_their_seed():
    numbers = [number_of(SoftMotionSimulator(seed=1)) for _ in range(20)]
    assert None not in numbers
    assert len(set(numbers)) == 20


@pytest.mark.usefixtures("mailbox_program")
def test_a_start_of_the_plc_keeps_its_number():
    simulator = plc()
    before = number_of(simulator)
    simulator.panel.restart()
    assert number_of(simulator) == before


@pytest.mark.usefixtures("mailbox_program")
def test_a_state_file_keeps_what_was_drawn(tmp_path):
    before = number_of(plc(tmp_path / "plc.json"))
    assert number_of(plc(tmp_path / "plc.json")) == before
    assert number_of(plc(tmp_path / "other.json")) != before


@pytest.mark.usefixtures("mailbox_program")
def test_a_state_file_of_an_earlier_simulator_gets_a_number_and_keeps_it(tmp_path):
    path = tmp_path / "plc.json"
    plc(path)
    document = json.loads(path.read_text())
    del document["memory"]["device_id"]
    path.write_text(json.dumps(document))
    before = number_of(plc(path))
    assert before is not None
    assert number_of(plc(path)) == before


@pytest.mark.usefixtures("mailbox_program")
@pytest.mark.parametrize("bent", [0, -3, 2**32, "seven"])
def test_a_state_file_with_an_impossible_number_is_refused(tmp_path, bent):
    path = tmp_path / "plc.json"
    plc(path)
    document = json.loads(path.read_text())
    document["memory"]["device_id"] = bent
    path.write_text(json.dumps(document))
    with pytest.raises(ConfigError, match="not a saved state"):
        plc(path)


@pytest.mark.usefixtures("mailbox_program")
def test_a_number_may_be_given_and_a_program_may_have_none():
    assert number_of(plc(device_id=0x1234_BEEF)) == 0x1234_BEEF
    assert number_of(plc(identified=False)) is None


@pytest.mark.usefixtures("mailbox_program")
def test_a_number_that_does_not_fit_is_refused_with_its_range():
    assert options_from_text({"device_id": str(2**32 - 1)}).mailbox.device_id == 2**32 - 1
    with pytest.raises(ConfigError, match="4294967296") as refusal:
        options_from_text({"device_id": str(2**32)})
    assert "1 to 4294967295" in refusal.value.remedy


@pytest.mark.usefixtures("mailbox_program")
def test_the_number_stands_behind_the_last_slot_also_while_the_program_stands_still():
    simulator = plc(device_id=7)
    shown = simulator.plc.read(DEVICE_START - 2, 6, simulator.now_ns)
    assert shown[2:] == encode_device_id(7)
    simulator.panel.freeze()
    assert simulator.plc.read(DEVICE_START, 4, simulator.now_ns) == encode_device_id(7)


@pytest.mark.usefixtures("mailbox_program")
def test_the_driver_reads_the_number_on_connecting(cell):
    controller = cell.met()
    assert controller.device_id == 0x1234_BEEF
    assert controller.mailbox_facts().device_id == 0x1234_BEEF
    assert controller.facts().controller_serial == "1234BEEF"


@pytest.mark.usefixtures("mailbox_program")
def test_a_program_without_it_is_no_obstacle(cell):
    cell.plc.device = (0, 0, 0, 0)
    controller = cell.met()
    assert controller.device_id is None
    assert controller.facts().controller_serial is None


@pytest.mark.usefixtures("mailbox_program")
def test_a_far_end_that_refuses_the_registers_has_no_number(cell):
    def refuse(_deliver):
        raise RejectedError("exception 2", remedy="none")

    cell.link.plan("read_device", refuse)
    assert cell.met().device_id is None


@pytest.mark.usefixtures("mailbox_program")
def test_a_number_that_is_drawn_just_now_is_read_again(cell):
    torn = (0xBEEF, 0x1234, 0, 0)
    cell.link.plan("read_device", lambda _deliver: torn)
    assert cell.met().device_id == 0x1234_BEEF


# EPSON's angles and the PLC's are the same rotation; scipy is the oracle.

ANGLE = st.floats(-360, 360) | st.sampled_from([-180.0, -90.0, 0.0, 90.0, 180.0, 1e-9, 90 + 1e-10])
LENGTH = st.floats(-2000, 2000)
COORDINATES = st.tuples(LENGTH, LENGTH, LENGTH, ANGLE, ANGLE, ANGLE)
UNITS = st.sampled_from([1.0, 10.0, 1000.0, 25400.0, 1e6])


def uvw_matrix(angles_deg):
    return Rotation.from_euler("ZYX", angles_deg, degrees=True).as_matrix()


def zyz_matrix(angles_deg):
    return Rotation.from_euler("ZYZ", angles_deg, degrees=True).as_matrix()


@pytest.mark.fault("F40")
@given(COORDINATES)
@settings(deadline=None, max_examples=80)
@example((0.0, 0.0, 0.0, 40.0, 180.0, 180.0))
@example((0.0, 0.0, 0.0, 40.0, 0.0, 180.0))
def test_f40_the_plc_gets_the_same_rotation(coordinates):
    frame = to_frame(coordinates, unit_um=1000.0)
    np.testing.assert_allclose(zyz_matrix(frame[3:]), uvw_matrix(coordinates[3:]), atol=1e-11)
    assert 0 <= frame[4] <= 180


@given(COORDINATES)
@settings(deadline=None, max_examples=80)
@example((0.0, 0.0, 0.0, 40.0, 90.0, 30.0))
def test_the_rotation_of_the_plc_is_read_right(frame):
    coordinates = from_frame(frame, unit_um=1000.0)
    np.testing.assert_allclose(uvw_matrix(coordinates[3:]), zyz_matrix(frame[3:]), atol=1e-11)
    assert -90 <= coordinates[4] <= 90


@given(COORDINATES, UNITS)
@settings(deadline=None, max_examples=40)
def test_there_and_back_is_the_same_tool(coordinates, unit_um):
    back = from_frame(to_frame(coordinates, unit_um=unit_um), unit_um=unit_um)
    assert back[:3] == pytest.approx(coordinates[:3], rel=1e-12, abs=1e-12)
    np.testing.assert_allclose(uvw_matrix(back[3:]), uvw_matrix(coordinates[3:]), atol=1e-11)


@given(st.floats(-180, 180, exclude_min=True))
@settings(deadline=None, max_examples=25)
def test_a_turn_about_the_flange_stands_in_a_alone(u_deg):
    frame = to_frame(ToolOffset(1, 2, 3, u_deg).components(), unit_um=1000.0)
    assert frame[3] == pytest.approx(u_deg, abs=1e-12)
    assert frame[4:] == (0.0, 0.0)
    assert from_frame(frame, unit_um=1000.0)[3:] == pytest.approx((u_deg, 0, 0), abs=1e-12)


def test_a_tool_that_points_back_has_one_angle_too():
    frame = to_frame((0, 0, 0, 30.0, 180.0, 0.0), unit_um=1000.0)
    assert frame[4:] == (180.0, 0.0)
    np.testing.assert_allclose(zyz_matrix(frame[3:]), uvw_matrix((30, 180, 0)), atol=1e-12)


@each_row(("unit_um", "expected"), [(1000.0, 12.5), (1.0, 12500.0), (10000.0, 1.25), (1e6, 0.0125)])
def test_lengths_are_in_user_units(unit_um, expected):
    assert to_frame((12.5, 0, 0, 0, 0, 0), unit_um=unit_um)[0] == pytest.approx(expected, rel=1e-15)
    assert from_frame((expected, 0, 0, 0, 0, 0), unit_um=unit_um)[0] == pytest.approx(12.5)


@pytest.mark.fault("F40")
def test_the_numbers_worked_by_hand():
    # docs/reference/softmotion.md 1.3: R(30, 40, 50) of the PLC, its tool axis
    u, v, w = from_frame((0, 0, 0, 30.0, 40.0, 50.0), unit_um=1000.0)[3:]
    assert uvw_matrix((u, v, w))[:, 2] == pytest.approx((0.556670, 0.321394, 0.766044), abs=1e-6)


def test_angles_that_mean_the_same_are_the_same_frame():
    # docs/reference/softmotion.md 1.3
    one = (1.0, 2.0, 3.0, 30.0, 0.0, 50.0)
    assert frames_match(one, (1.0, 2.0, 3.0, 80.0, 0.0, 0.0), tolerance=1e-9)
    assert frames_match(one, (1.0, 2.0, 3.0, 0.0, 0.0, 80.0), tolerance=1e-9)
    assert frames_match((0, 0, 0, 10, 20, 30), (0, 0, 0, 190, -20, 210), tolerance=1e-9)


@each_row("place", range(6))
def test_frames_that_differ_are_told_apart(place):
    one = (1.0, 2.0, 3.0, 10.0, 20.0, 30.0)
    x, y, z, a, b, c = (value + 1e-5 * (n == place) for n, value in enumerate(one))
    assert not frames_match(one, (x, y, z, a, b, c), tolerance=1e-9)
    assert frames_match(one, (x, y, z, a, b, c), tolerance=2e-5)


@each_row("place", range(6))
def test_what_is_no_number_is_equal_to_nothing(place):
    x, y, z, a, b, c = (math.nan if at == place else 10.0 * at for at in range(6))
    frame = (x, y, z, a, b, c)
    assert not frames_match(frame, frame, tolerance=1e9)


@pytest.mark.usefixtures("mailbox_program")
def test_a_number_that_was_read_wrong_is_not_the_name_under_which_a_write_is_marked(cell):
    cell.link.plan("read_device", lambda _deliver: encode_device_id(0x1234_BEEE))
    controller = cell.met()
    assert controller.outcomes.identity == "softmotion:1234BEEF"
    assert controller.device_id == 0x1234_BEEF
