"""A bounded look at which addresses accept a TCP connection."""

import ipaddress
import socket
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from robolink.errors import ConfigError
from robolink.messages import tr

MOST: Final = 256
"""Addresses in one scan; more would be a search of somebody's network."""

_AT_ONCE: Final = 32


class State(StrEnum):
    """What an address did."""

    OPEN = "open"
    REFUSED = "refused"
    SILENT = "silent"
    UNREACHABLE = "unreachable"


@dataclass(frozen=True, slots=True)
class AddressProbe:
    """One address, what it did and how long that took."""

    address: str
    state: State
    elapsed_ms: float


def parse_range(text: str) -> list[str]:
    """Return the addresses of ``A``, ``A-LAST``, ``A-B`` or ``A/PREFIX``, all IPv4.

    Raises:
        ConfigError: It is none of these, or more than 256.
    """
    try:
        first, last = _ends(text)
    except ValueError as error:
        raise ConfigError(
            tr("{text!r} is not a range of addresses.", text=text),
            remedy=tr("Write 192.168.0.7, 192.168.0.1-20 or 192.168.0.0/28."),
        ) from error
    count = last - first + 1
    if not 1 <= count <= MOST:
        raise ConfigError(
            tr("{text!r} stands for {count} addresses.", text=text, count=max(count, 0)),
            remedy=tr("Give from 1 to {most} addresses, in rising order.", most=MOST),
        )
    return [str(ipaddress.IPv4Address(number)) for number in range(first, last + 1)]


def probe_all(addresses: Sequence[str], port: int, timeout_s: float) -> list[AddressProbe]:
    """Connect to each address and close again; nothing is sent. In the order given."""
    workers = ThreadPoolExecutor(min(_AT_ONCE, len(addresses)), thread_name_prefix="scan")
    try:
        return list(workers.map(lambda address: _probe(address, port, timeout_s), addresses))
    finally:
        # Ctrl-C waits for the connections under way, not for the whole range.
        workers.shutdown(cancel_futures=True)


def _ends(text: str) -> tuple[int, int]:
    if "/" in text:
        network = ipaddress.IPv4Network(text, strict=False)
        return int(network.network_address), int(network.broadcast_address)
    start, dash, end = text.partition("-")
    first = ipaddress.IPv4Address(start)
    if not dash:
        return int(first), int(first)
    if "." not in end:
        end = f"{start.rpartition('.')[0]}.{end}"
    return int(first), int(ipaddress.IPv4Address(end))


def _probe(address: str, port: int, timeout_s: float) -> AddressProbe:
    begun = time.perf_counter()
    try:
        socket.create_connection((address, port), timeout=timeout_s).close()
        state = State.OPEN
    except TimeoutError:
        state = State.SILENT
    except ConnectionRefusedError:
        state = State.REFUSED
    except OSError:
        state = State.UNREACHABLE
    return AddressProbe(address, state, round((time.perf_counter() - begun) * 1000, 1))
