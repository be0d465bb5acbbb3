"""Behaviour of third-party clients, and ours, when an answer is late, old, in pieces, or lost.

All of them use the same proxy to the same simulators. The assertions are about ours; the results of
the others are printed, to be compared with docs/contributing.md: ``pytest -s``.
"""

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest

from robolink.errors import RemoteProtocolError
from tests.peers._faulty_proxy import LATE_S

pytest.importorskip("minimalmodbus", reason="minimalmodbus is not here: make peers installs it")

from tests.peers._clients import PEERS, peer

OURS = [name for name in PEERS if name.startswith("robolink")]
_LONGEST_S = 5.0


class Shown:
    """The result of one client for one fault, in words."""

    def __init__(self, client: Any, truth: dict[int, object]) -> None:
        self._client = client
        self._truth = truth
        self.words: list[str] = []
        self.seconds = 0.0

    def read(self, which: int) -> None:
        """Read a value and compare it with the truth."""
        self._do(lambda: self._client.read(which), self._truth[which])

    def write(self) -> None:
        """Write once; an acknowledgement is all that can be right."""
        self._do(self._client.write, None)

    def _do(self, act: Callable[[], object], right: object) -> None:
        began = time.monotonic()
        try:
            found = act()
        except Exception as error:
            self.words.append(f"error ({type(error).__name__})")
        else:
            self.words.append("right" if found == right else "WRONG VALUE")
        self.seconds = time.monotonic() - began


def truth_of(client: Any) -> dict[int, object]:
    """Read both values undisturbed."""
    client.open(stale=False)
    truth = {which: client.read(which) for which in (1, 2)}
    assert truth[1] != truth[2]
    client.close()
    return truth


def shown(name: str, fault: Any) -> tuple[Shown, int]:
    """Let a client meet a fault; return its result, and the number of frames sent.

    For a write (F25) only the frames that carry it are counted.
    """
    with peer(name) as client:
        result = Shown(client, truth_of(client))
        client.open(stale=fault == "F03")
        if fault == "F03":
            client.wire.arm("")
            result.read(1)
            return result, len(client.wire.frames)
        if fault == "F25":
            client.wire.arm(fault, client.is_write)
            result.write()
            return result, sum(client.is_write(frame) for frame in client.wire.frames)
        client.wire.arm(fault)
        result.read(1)
        frames = len(client.wire.frames)
        if fault == "F01":
            time.sleep(LATE_S)  # the late answer is there before the next question
            result.read(2)
        return result, frames


FAULTS = ("F01", "F03", "F05", "F11", "F25")


@pytest.mark.parametrize(
    ("fault", "name"),
    # F05 splits an answer, but a CAN frame arrives whole.
    [
        (fault, name)
        for fault in FAULTS
        for name in PEERS
        if (fault, "CAN" in name) != ("F05", True)
    ],
)
def test_what_is_returned_when(name, fault):
    try:
        result, frames = shown(name, fault)
    except RemoteProtocolError:  # ours does not even connect while an old answer waits
        assert fault == "F03"
        print(f"\n{fault} | {name} | refuses to connect (RemoteProtocolError)")  # noqa: T201
        return
    took = f" after {result.seconds:.1f} s" if fault in ("F11", "F25") else ""
    of_what = "frames with the write" if fault == "F25" else "frames for the first"
    print(f"\n{fault} | {name} | {', then '.join(result.words)}{took} | {frames} {of_what}")  # noqa: T201
    if name in OURS:
        assert "WRONG VALUE" not in result.words
        assert fault != "F25" or frames == 1
        assert result.seconds < _LONGEST_S
        if fault == "F05":
            assert result.words == ["right"]


def test_the_proxy_does_not_disturb_by_itself():
    for name in PEERS:
        with peer(name) as client:
            truth = truth_of(client)
            client.open(stale=False)
            client.wire.arm("")
            assert client.read(1) == truth[1], name
            with suppress(Exception):
                client.write()
            assert sum(client.is_write(frame) for frame in client.wire.frames) >= 1, name
