"""Registers of a camera over UDP, against a socket that answers as it likes."""

import socket
import struct
import threading
from collections.abc import Callable
from contextlib import contextmanager

import pytest

from robolink.eye.cameras.gige.gvcp import GvcpRefusedError, gvcp_channel


@contextmanager
def camera(answers: Callable[[bytes, int], list[bytes]]):
    """Serve a camera; ``answers`` gets a request and its place in the order."""
    asked = list[bytes]()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as served:
        served.bind(("127.0.0.1", 0))
        served.settimeout(5)

        def answer():
            while True:
                try:
                    request, to = served.recvfrom(2048)
                except OSError:
                    return
                if request == b"end":
                    return
                asked.append(request)
                for reply in answers(request, len(asked)):
                    served.sendto(reply, to)

        thread = threading.Thread(target=answer)
        thread.start()
        try:
            yield served.getsockname()[1], asked
        finally:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as last:
                last.sendto(b"end", served.getsockname())
            thread.join()


def acknowledged(request: bytes, value: int, *, status: int = 0, number: int | None = None):
    _, command, _, asked = struct.unpack_from(">HHHH", request)
    head = struct.pack(">HHHH", status, command + 1, 4, asked if number is None else number)
    return head + struct.pack(">I", value)


def test_a_register_is_read_and_written():
    with camera(lambda request, _: [acknowledged(request, 0xCAFE)]) as (port, asked):
        with gvcp_channel("127.0.0.1", port=port, timeout_s=0.2) as channel:
            assert channel.read(0x0A00) == 0xCAFE
            assert channel.write(0x0A00, 2)
            assert channel.own_address == "127.0.0.1"
    read, written = asked
    assert read[:6] + read[8:] == bytes.fromhex("4201 0080 0004 00000a00")
    assert written[:6] + written[8:] == bytes.fromhex("4201 0082 0008 00000a00 00000002")


def test_a_request_that_was_lost_is_asked_again():
    def second(request: bytes, number: int) -> list[bytes]:
        return [acknowledged(request, 7)] if number == 2 else []

    with (
        camera(second) as (port, asked),
        gvcp_channel("127.0.0.1", port=port, timeout_s=0.2) as channel,
    ):
        assert channel.read(0x0A00) == 7
    assert len(asked) == 2


def test_answers_to_another_request_and_rubbish_are_passed_over():
    def answers(request: bytes, _: int) -> list[bytes]:
        return [b"", b"\0\0", acknowledged(request, 1, number=0), acknowledged(request, 9)]

    with (
        camera(answers) as (port, _),
        gvcp_channel("127.0.0.1", port=port, timeout_s=0.2) as channel,
    ):
        assert channel.read(0x0A00) == 9


def test_a_refusal_is_told():
    with camera(lambda request, _: [acknowledged(request, 0, status=0x8006)]) as (port, _):
        with gvcp_channel("127.0.0.1", port=port, timeout_s=0.2) as channel:
            with pytest.raises(GvcpRefusedError) as caught:
                channel.read(0x0A00)
    assert caught.value.args == (0x8006,)


def test_silence_is_none():
    with camera(lambda *_: []) as (port, asked):
        with gvcp_channel("127.0.0.1", port=port, timeout_s=0.05, tries=3) as channel:
            assert channel.read(0x0A00) is None
    assert len(asked) == 3


def test_a_port_that_is_closed_is_none():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with gvcp_channel("127.0.0.1", port=port, timeout_s=0.2) as channel:
        assert channel.read(0x0A00) is None
