"""tshark dissects the traffic of our client and the simulated PLC on a CAN bus."""

import struct
import threading

import can
import pytest
from robolink_simulators.hosting.fieldbus.canopen_node import CanPlace, serve_canopen
from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.protocols.mailbox import decode_command
from tests._patience import PATIENCE_S
from tests.peers._pcap import write_can
from tests.peers._tshark import (
    SLOT,
    complaints,
    dissected,
    require_the_tool_written,
    summaries,
    write_a_tool,
)

CANOPEN = ("-d", "can.subdissector,canopen")
OBJECT = ("canopen.sdo.main_idx", "canopen.sdo.sub_idx")
SEGMENT = ("canopen.sdo.ccs", "canopen.sdo.main_idx", "canopen.sdo.data.bytes")
DOWNLOAD_SEGMENT, INITIATE_DOWNLOAD = "0", "1"
COMMAND = 0x2100
CLIENT_SDO = 0x605
OPERATIONAL = (0x705, b"\x05")
"""A heartbeat; one comes only every 100 ms."""


@pytest.fixture
def frames(tmp_path):
    """The frames that a listener on the bus received while a tool was written."""
    seen: list[can.Message] = []
    operational = threading.Event()

    def keep(frame: can.Message) -> None:
        seen.append(frame)
        if (frame.arbitration_id, bytes(frame.data)) == OPERATIONAL:
            operational.set()

    place = CanPlace("virtual", tmp_path.name)
    with can.Bus(interface="virtual", channel=tmp_path.name) as bus:
        listener = can.Notifier(bus, [keep], timeout=0.02)
        with serve_canopen(SoftMotionSimulator(), place) as host:
            write_a_tool(host.url)
            assert operational.wait(PATIENCE_S)
        listener.stop()
    return seen


@pytest.fixture
def capture(frames, tmp_path):
    """The capture of these frames."""
    write_can(tmp_path / "canopen.pcap", frames)
    return tmp_path / "canopen.pcap"


def downloads(capture, index):
    """Return the words of each download to an object, joined from its segments."""
    data: list[bytes] = []
    sizes: list[int] = []
    wanted = False
    for ccs, main, text in dissected(capture, SEGMENT, where=SEGMENT[0], options=CANOPEN):
        part = bytes.fromhex(text)
        if ccs == INITIATE_DOWNLOAD:
            wanted = int(main, 16) == index
            if wanted:
                sizes.append(int.from_bytes(part, "little"))
                data.append(b"")
        elif ccs == DOWNLOAD_SEGMENT and wanted:
            data[-1] += part
    whole = [part[:size] for part, size in zip(data, sizes, strict=True)]
    return [struct.unpack(f"<{len(part) // 2}H", part) for part in whole]


def test_nothing_is_malformed_and_all_of_it_is_canopen(capture, frames):
    assert complaints(capture, options=CANOPEN) == []
    assert len(summaries(capture, where="canopen", options=CANOPEN)) == len(frames)


def test_sdo_pdo_and_heartbeat_frames_are_named(capture):
    lines = summaries(capture, options=CANOPEN)
    kinds = {line.split("CANopen", 1)[1].split(None, 1)[1] for line in lines}
    assert {
        "NMT Error Control: Boot-up [0x5]",
        "NMT Error Control: Operational [0x5]",
        "NMT: Start remote node [0x5]",
        "PDO1 (tx)",
        "Default-SDO (rx): Initiate download request",
        "Default-SDO (tx): Upload segment response",
    } <= kinds
    assert not [kind for kind in kinds if "Abort" in kind or "Unknown" in kind]


def test_the_objects_are_those_of_the_data_sheet(capture):
    found = dissected(capture, OBJECT, where=OBJECT[0], options=CANOPEN)
    objects = {(int(index, 16), int(subindex, 16)) for index, subindex in found}
    fixed = {(0x1017, 0), (0x1018, 4)}
    assert objects == {*fixed, (COMMAND, 0), (0x2101, 0), (0x2102, 5), (0x2200, SLOT)}


def test_the_segments_make_up_the_commands_that_write_the_tool(capture):
    require_the_tool_written([decode_command(words) for words in downloads(capture, COMMAND)])


def test_a_frame_that_is_too_short_would_have_been_found(frames, tmp_path):
    n = next(n for n, frame in enumerate(frames) if frame.arbitration_id == CLIENT_SDO)
    frames[n] = can.Message(
        arbitration_id=CLIENT_SDO, data=frames[n].data[:2], is_extended_id=False
    )
    write_can(tmp_path / "short.pcap", frames)
    assert len(complaints(tmp_path / "short.pcap", options=CANOPEN)) == 1
