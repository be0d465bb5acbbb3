"""A controller on a separate computer whose power can be cut: a network namespace.

Needs root and ``ip`` of iproute2. The address is removed: nothing answers any more, and nothing
reports it, as when a controller or a switch loses its power (docs/reference/faults.md F11).
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Final

import pytest

_MASK: Final = 30
_numbers = count(os.getpid() % 200)


class FarComputer:
    """A computer that serves a simulator.

    Attributes:
        url: The simulator's URL.
    """

    def __init__(self, space: str, device: str, address: str) -> None:
        self.url = ""
        self._space, self._device, self._address = space, device, address

    def lose_power(self) -> None:
        """Make the computer silent."""
        given = f"{self._address}/{_MASK}"
        _ip("-n", self._space, "addr", "del", given, "dev", self._device)


@contextmanager
def far_computer(*served: str) -> Iterator[FarComputer]:
    """Serve ``robolink sim`` with these words, in which ``{address}`` stands for its address.

    Skips the test on a computer that allows no network namespace.
    """
    if not shutil.which("ip"):
        pytest.skip("needs the command ip (iproute2)")
    number = next(_numbers) % 250
    space, near, far = f"rl{os.getpid()}-{number}", f"rln{number}", f"rlf{number}"
    here, there = f"10.213.{number}.1", f"10.213.{number}.2"
    try:
        _ip("netns", "add", space)
    except RuntimeError as error:
        pytest.skip(f"no network namespace can be made here: {error}")
    try:
        _ip("link", "add", near, "type", "veth", "peer", "name", far, "netns", space)
        _ip("addr", "add", f"{here}/{_MASK}", "dev", near)
        _ip("-n", space, "addr", "add", f"{there}/{_MASK}", "dev", far)
        _ip("link", "set", near, "up")
        _ip("-n", space, "link", "set", far, "up")
        _ip("-n", space, "link", "set", "lo", "up")
        computer = FarComputer(space, far, there)
        words = [word.format(address=there) for word in served]
        command = [sys.executable, "-m", "robolink_cli", "sim", *words, "--allow-remote", "--json"]
        with subprocess.Popen(
            ["ip", "netns", "exec", space, *command], stdout=subprocess.PIPE, text=True
        ) as server:
            try:
                assert server.stdout is not None
                computer.url = _url_in(json.loads(server.stdout.readline()))
                yield computer
            finally:
                server.kill()
    finally:
        _ip("netns", "del", space)


def _url_in(document: dict[str, object]) -> str:
    url = document["url"]
    return str(url)


def _ip(*words: str) -> None:
    done = subprocess.run(["ip", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr.strip())
