"""The number that a PLC draws once: in words, in a simulator, and as the driver reads it."""

import json

import pytest
from robolink_simulators.softmotion.mailbox import (
    MailboxOptions,
    PlcOptions,
    SoftMotionSimulator,
)
from robolink_simulators.softmotion.mailbox.option_text import options_from_text

from robolink.controllers import read_device_id
from robolink.errors import ConfigError, RejectedError
from robolink.protocols.mailbox import (
    DEVICE_START,
    BlockError,
    decode_device_id,
    encode_device_id,
)
from tests.unit._mailbox_client import linked
from tests.unit.softmotion_driver._cell import Cell

pytestmark = pytest.mark.usefixtures("mailbox_program")


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


@pytest.mark.parametrize("device_id", [1, 0xFFFF, 0x10000, 0x1234_BEEF, 0xFFFF_FFFF])
def test_a_number_goes_into_four_words_and_comes_back(device_id):
    words = encode_device_id(device_id)
    assert words[:2] == (device_id & 0xFFFF, device_id >> 16)
    assert all(word ^ other == 0xFFFF for word, other in zip(words[:2], words[2:], strict=True))
    assert decode_device_id(words) == device_id


@pytest.mark.parametrize("device_id", [0, -1, 2**32])
def test_what_is_no_number_of_a_plc_is_not_encoded(device_id):
    with pytest.raises(BlockError):
        encode_device_id(device_id)


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


def test_two_simulators_have_two_numbers_though_they_share_their_seed():
    numbers = [number_of(SoftMotionSimulator(seed=1)) for _ in range(20)]
    assert None not in numbers
    assert len(set(numbers)) == 20


def test_a_start_of_the_plc_keeps_its_number():
    simulator = plc()
    before = number_of(simulator)
    simulator.panel.restart()
    assert number_of(simulator) == before


def test_a_state_file_keeps_what_was_drawn(tmp_path):
    before = number_of(plc(tmp_path / "plc.json"))
    assert number_of(plc(tmp_path / "plc.json")) == before
    assert number_of(plc(tmp_path / "other.json")) != before


def test_a_state_file_of_an_earlier_simulator_gets_a_number_and_keeps_it(tmp_path):
    path = tmp_path / "plc.json"
    plc(path)
    document = json.loads(path.read_text())
    del document["memory"]["device_id"]
    path.write_text(json.dumps(document))
    before = number_of(plc(path))
    assert before is not None
    assert number_of(plc(path)) == before


@pytest.mark.parametrize("bent", [0, -3, 2**32, "seven"])
def test_a_state_file_with_an_impossible_number_is_refused(tmp_path, bent):
    path = tmp_path / "plc.json"
    plc(path)
    document = json.loads(path.read_text())
    document["memory"]["device_id"] = bent
    path.write_text(json.dumps(document))
    with pytest.raises(ConfigError, match="not a saved state"):
        plc(path)


def test_a_number_may_be_given_and_a_program_may_have_none():
    assert number_of(plc(device_id=0x1234_BEEF)) == 0x1234_BEEF
    assert number_of(plc(identified=False)) is None


def test_a_number_that_does_not_fit_is_refused_with_its_range():
    assert options_from_text({"device_id": str(2**32 - 1)}).mailbox.device_id == 2**32 - 1
    with pytest.raises(ConfigError, match="4294967296") as refusal:
        options_from_text({"device_id": str(2**32)})
    assert "1 to 4294967295" in refusal.value.remedy


def test_the_number_stands_behind_the_last_slot_also_while_the_program_stands_still():
    simulator = plc(device_id=7)
    shown = simulator.plc.read(DEVICE_START - 2, 6, simulator.now_ns)
    assert shown[2:] == encode_device_id(7)
    simulator.panel.freeze()
    assert simulator.plc.read(DEVICE_START, 4, simulator.now_ns) == encode_device_id(7)


def test_the_driver_reads_the_number_on_connecting(cell):
    controller = cell.met()
    assert controller.device_id == 0x1234_BEEF
    assert controller.mailbox_facts().device_id == 0x1234_BEEF
    assert controller.facts().controller_serial == "1234BEEF"


def test_a_program_without_it_is_no_obstacle(cell):
    cell.plc.device = (0, 0, 0, 0)
    controller = cell.met()
    assert controller.device_id is None
    assert controller.facts().controller_serial is None


def test_a_far_end_that_refuses_the_registers_has_no_number(cell):
    def refuse(_deliver):
        raise RejectedError("exception 2", remedy="none")

    cell.link.plan("read_device", refuse)
    assert cell.met().device_id is None


def test_a_number_that_is_drawn_just_now_is_read_again(cell):
    torn = (0xBEEF, 0x1234, 0, 0)
    cell.link.plan("read_device", lambda _deliver: torn)
    assert cell.met().device_id == 0x1234_BEEF
