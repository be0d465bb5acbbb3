"""Failures of a mailbox link when its far end or the connection to it fails."""

import socket
import threading
import time
from contextlib import closing, contextmanager

import pytest

from robolink.errors import (
    ConnectError,
    RejectedError,
    RemoteProtocolError,
    TransportBrokenError,
    TransportClosedError,
    TransportError,
    TransportTimeoutError,
)
from robolink.transport import open_mailbox_link
from tests.contract._mailbox_far_ends import modbus_rtu, virtual_node

COMMAND = tuple(range(1000, 1064))
RESPONSE = tuple(range(100, 212))
SLOT = tuple(range(100, 136))


@contextmanager
def silent_server():
    with socket.create_server(("127.0.0.1", 0)) as listening:
        yield listening, f"softmotion+modbus-tcp://127.0.0.1:{listening.getsockname()[1]}"


def test_a_silent_server_times_out_within_one_deadline_and_hears_one_request():
    with silent_server() as (listening, url):
        with closing(open_mailbox_link(url, timeout_s=0.2)) as link:
            peer, _ = listening.accept()
            began = time.monotonic()
            with peer, pytest.raises(TransportTimeoutError):
                link.write_command(COMMAND)
            assert 0.15 < time.monotonic() - began < 1.0
            with pytest.raises(TransportClosedError):
                link.read_head()


def test_a_server_that_hangs_up_in_the_middle_is_broken_and_not_dialled_again():
    with silent_server() as (listening, url):
        with closing(open_mailbox_link(url, timeout_s=1.0)) as link:
            peer, _ = listening.accept()

            def hang_up():
                peer.recv(1024)
                peer.close()

            thread = threading.Thread(target=hang_up)
            thread.start()
            with pytest.raises(TransportBrokenError):
                link.read_response()
            thread.join(5)
            with pytest.raises(TransportError):
                link.read_response()
            listening.settimeout(0.1)
            with pytest.raises(TimeoutError):
                listening.accept()


def test_nothing_listens_there():
    with silent_server() as (_, url):
        pass
    with pytest.raises(ConnectError, match="refuses"):
        open_mailbox_link(url, timeout_s=1.0)


@pytest.mark.fault("F55")
def test_f55_a_serial_port_is_opened_by_one_program_alone():
    with modbus_rtu() as (far_end, _):
        with closing(open_mailbox_link(far_end.url)):
            with pytest.raises(ConnectError, match="cannot be opened"):
                open_mailbox_link(far_end.url)


def test_a_serial_port_that_is_not_there_is_named():
    with pytest.raises(ConnectError, match="/dev/no-such-port") as caught:
        open_mailbox_link("softmotion+modbus-rtu:///dev/no-such-port")
    assert "robolink cell ports" in caught.value.remedy


def test_a_unit_that_keeps_silent_is_found_on_opening():
    with modbus_rtu() as (far_end, cable):
        cable.cut = True
        with pytest.raises(ConnectError, match="Unit 9 does not answer") as caught:
            open_mailbox_link(f"{far_end.url}&unit=9", timeout_s=0.2)
        assert "parity" in caught.value.remedy


def test_a_cut_serial_cable_times_out_and_a_mended_one_serves_on():
    with modbus_rtu() as (far_end, cable):
        far_end.put_response(RESPONSE)
        with closing(open_mailbox_link(far_end.url, timeout_s=0.3)) as link:
            cable.cut = True
            with pytest.raises(TransportTimeoutError):
                link.read_response()
            cable.cut = False
            assert link.read_response() == RESPONSE


@pytest.mark.fault("F53")
def test_f53_an_adapter_that_hears_itself_is_named_on_opening():
    with modbus_rtu(echo=True) as (far_end, _):
        with pytest.raises(RemoteProtocolError, match="returns what is sent"):
            open_mailbox_link(far_end.url, timeout_s=0.5)


def test_nobody_on_the_bus_is_found_on_opening(tmp_path):
    url = f"softmotion+can://{tmp_path.name}?interface=virtual&node=7"
    with pytest.raises(ConnectError, match="Node 7"):
        open_mailbox_link(url, timeout_s=0.1)


def test_opening_starts_the_node(tmp_path):
    with virtual_node(tmp_path.name) as far_end:
        with closing(open_mailbox_link(far_end.url)):
            for _ in range(100):
                if far_end.node.nmt.state == "OPERATIONAL":
                    break
                time.sleep(0.01)
            assert far_end.node.nmt.state == "OPERATIONAL"


def test_a_node_that_dies_is_noticed_by_its_heartbeat(tmp_path):
    with virtual_node(tmp_path.name) as far_end:
        with closing(open_mailbox_link(far_end.url, timeout_s=3.0)) as link:
            far_end.stop()
            with pytest.raises(TransportBrokenError, match="lost its heartbeat"):
                link.read_response()


def test_an_object_that_the_node_lacks_is_a_refusal(tmp_path):
    with virtual_node(tmp_path.name) as far_end:
        with closing(open_mailbox_link(far_end.url)) as link:
            with pytest.raises(RejectedError, match="060A0023h"):
                link.read_slot(4)  # known, but never given a value
            far_end.put_slot(4, SLOT)
            assert link.read_slot(4) == SLOT


def test_a_wait_on_a_bus_ends_when_another_thread_closes(tmp_path):
    with virtual_node(tmp_path.name) as far_end:
        require_end_on_close(open_mailbox_link(far_end.url, timeout_s=5.0))


def test_a_wait_on_a_serial_line_ends_when_another_thread_closes():
    with modbus_rtu() as (far_end, cable):
        link = open_mailbox_link(far_end.url, timeout_s=5.0)
        cable.cut = True
        require_end_on_close(link)


def test_a_wait_on_a_connection_ends_when_another_thread_closes():
    with silent_server() as (_, url):
        require_end_on_close(open_mailbox_link(url, timeout_s=5.0))


def require_end_on_close(link):
    closer = threading.Timer(0.1, link.close)
    closer.start()
    with pytest.raises(TransportClosedError):
        link.read_head()
    closer.join(5)
