"""Captures in the classic pcap format: one TCP connection, or the frames of a CAN bus.

A TCP connection gets the packets that a network would have carried: opening, segments with
their acknowledgements, closing, all checksums right. The addresses are those kept for
documentation (RFC 5737).
"""

import struct
from collections.abc import Iterable, Iterator
from ipaddress import IPv4Address
from pathlib import Path
from typing import Final

import can

_MAGIC: Final = 0xA1B2C3D4
_RAW_IP, _CAN_SOCKETCAN = 101, 227
_CLIENT, _SERVER = IPv4Address("192.0.2.1").packed, IPv4Address("192.0.2.2").packed
_CLIENT_PORT, _MODBUS_PORT = 49152, 502
_FIN, _SYN, _PSH, _ACK = 1, 2, 8, 16
_TCP, _TIME_TO_LIVE, _WINDOW = 6, 64, 65535
_STEP_US: Final = 500

Said = tuple[bool, bytes]
"""Whether the client sent it, and the bytes."""


def write_modbus_tcp(path: Path, dialogue: Iterable[Said]) -> None:
    """Write the one connection with these messages of a Modbus client and a server."""
    packets = _Connection().packets(dialogue)
    _write(path, _RAW_IP, ((n * _STEP_US, packet) for n, packet in enumerate(packets)))


def write_can(path: Path, frames: Iterable[can.Message]) -> None:
    """Write frames with 11-bit identifiers, with their times."""
    records = (
        (
            round(frame.timestamp * 1e6),
            struct.pack(">IB3x", frame.arbitration_id, frame.dlc) + bytes(frame.data),
        )
        for frame in frames
    )
    _write(path, _CAN_SOCKETCAN, records)


def _write(path: Path, link_type: int, records: Iterable[tuple[int, bytes]]) -> None:
    with path.open("wb") as file:
        file.write(struct.pack("<IHHiIII", _MAGIC, 2, 4, 0, 0, 0xFFFF, link_type))
        for at_us, data in records:
            file.write(struct.pack("<IIII", *divmod(at_us, 1_000_000), len(data), len(data)))
            file.write(data)


class _Connection:
    """Numbers the bytes of both sides of one connection."""

    def __init__(self) -> None:
        self._sent = {True: 1000, False: 2000}

    def packets(self, dialogue: Iterable[Said]) -> Iterator[bytes]:
        """Yield all packets from the opening to the end."""
        yield self._packet(True, _SYN)
        yield self._packet(False, _SYN | _ACK)
        yield self._packet(True, _ACK)
        for from_client, data in dialogue:
            yield self._packet(from_client, _PSH | _ACK, data)
            yield self._packet(not from_client, _ACK)
        yield self._packet(True, _FIN | _ACK)
        yield self._packet(False, _FIN | _ACK)
        yield self._packet(True, _ACK)

    def _packet(self, from_client: bool, flags: int, data: bytes = b"") -> bytes:
        number, seen = self._sent[from_client], self._sent[not from_client]
        self._sent[from_client] += len(data) + bool(flags & (_SYN | _FIN))
        ports, hosts = (_CLIENT_PORT, _MODBUS_PORT), (_CLIENT, _SERVER)
        if not from_client:
            ports, hosts = ports[::-1], hosts[::-1]
        acknowledged = seen if flags & _ACK else 0
        header = struct.pack(
            ">HHIIBBHHH", *ports, number, acknowledged, 5 << 4, flags, _WINDOW, 0, 0
        )
        addressed = b"".join(hosts) + struct.pack(">HH", _TCP, len(header) + len(data))
        segment = _summed(header, 16, _checksum(addressed + header + data)) + data
        ip = struct.pack(
            ">BBHHHBBH", 4 << 4 | 5, 0, 20 + len(segment), 0, 0, _TIME_TO_LIVE, _TCP, 0
        ) + b"".join(hosts)
        return _summed(ip, 10, _checksum(ip)) + segment


def _summed(header: bytes, at: int, checksum: int) -> bytes:
    return header[:at] + struct.pack(">H", checksum) + header[at + 2 :]


def _checksum(data: bytes) -> int:
    """Return the checksum of the Internet protocols (RFC 1071)."""
    padded = data + b"\0" * (len(data) % 2)
    total: int = sum(struct.unpack(f">{len(padded) // 2}H", padded))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF
