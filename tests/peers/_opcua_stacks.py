"""OPC UA stacks of others, each in a process of its own, as server and as client."""

import json
import os
import queue
import shutil
import subprocess
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import pytest

from robolink.timing import SystemClock
from tests._patience import PATIENCE_S

ROOT: Final = Path(__file__).parents[2]
MODULES: Final = ROOT / ".venv/node-opcua"
ARCHIVES: Final = ROOT / ".venv/milo"
_HERE: Final = Path(__file__).parent


def _node_opcua(role: str) -> list[str]:
    node = shutil.which("node")
    if node is None or not (MODULES / "node_modules/node-opcua").exists():
        pytest.fail("node-opcua is not here: make peers fetches it with npm", pytrace=False)
    return [node, str(_HERE / f"opcua_{role}.mjs"), str(MODULES)]


def _milo(role: str) -> list[str]:
    classpath = os.environ.get("MILO_CLASSPATH") or os.pathsep.join(
        map(str, sorted(ARCHIVES.glob("*.jar")))
    )
    java, javac = shutil.which("java"), shutil.which("javac")
    if not (java and javac and classpath):
        pytest.skip(
            "Milo is not here: make peers fetches it with Maven, or MILO_CLASSPATH names its "
            "archives; it takes a JDK, 11 or later"
        )
    classes = _compiled(javac, classpath).name
    command = [java, "-XX:TieredStopAtLevel=1", "-cp", os.pathsep.join([classes, classpath])]
    return [*command, f"Milo{role.capitalize()}"]


@cache
def _compiled(javac: str, classpath: str) -> TemporaryDirectory[str]:
    """Compile our programs against Milo; the folder goes with this process."""
    folder = TemporaryDirectory(prefix="milo-")
    sources = map(str, sorted((_HERE / "milo").glob("*.java")))
    command = [javac, "--release", "11", "-nowarn", "-cp", classpath, "-d", folder.name, *sources]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.fail(f"javac:\n{done.stderr}", pytrace=False)
    return folder


STACKS: Final[Mapping[str, Callable[[str], list[str]]]] = {
    "node-opcua": _node_opcua,
    "Milo": _milo,
}
"""Returns the command of a stack as ``server`` or ``client``; fails or skips where it is not here.
"""


class Told:
    """A program that prints a JSON object a line, and takes them."""

    def __init__(self, stack: str, role: str, *arguments: object) -> None:
        command = [*STACKS[stack](role), *map(str, arguments)]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._lines: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self.others: list[dict[str, Any]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith("{"):  # messages of the stack itself do not
                self._lines.put(json.loads(line))
        self._lines.put({"ended": True})

    def next(self, *keys: str) -> Any:
        """Return the next object with one of the keys; the others are kept in ``others``."""
        while True:
            told = self._lines.get(timeout=PATIENCE_S)
            for key in keys:
                if key in told:
                    return told[key]
            if "ended" in told:
                raise EOFError(f"the program ended; it told {self.others}")
            self.others.append(told)

    def tell(self, **asked: object) -> None:
        """Send an object."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(asked) + "\n")
        self._process.stdin.flush()

    def kill(self) -> None:
        """End it as a loss of power would."""
        self._process.kill()
        self._process.wait(PATIENCE_S)

    def __enter__(self):
        return self

    def __exit__(self, *_details: object) -> None:
        self._process.kill()
        with suppress(subprocess.TimeoutExpired):
            self._process.communicate(timeout=PATIENCE_S)


class StackServer(Told):
    """The server: the mailbox of a simulated PLC that serves Modbus TCP, and tools of its own.

    Args:
        stack: One of :data:`STACKS`.
        folder: For its files.
        modbus_port: Of the simulated PLC.
        more: Name and password of its only user; ``--refuse-certificates``, so that it trusts no
            client; ``--port=N``.
    """

    def __init__(self, stack: str, folder: Path, modbus_port: int, *more: str) -> None:
        super().__init__(stack, "server", folder, modbus_port, *more)
        listening = self.next("listening")
        self.port: int = listening["port"]
        self.sha256: str = listening["sha256"]

    def forget(self) -> None:
        """Put the first tool back, and drop what has been told so far."""
        for name, value in (("aTool1", [12.0, -3.5, -20.0, 15.0, 0.0, 0.0]), ("xPermit", True)):
            self.tell(set=name, value=value)
            self.next("set")
        self.others.clear()

    def wrote(self, name: str) -> list[Any]:
        """Return what has been written to a variable, oldest first."""
        self.tell(set="uiCycle", value=0)
        self.next("set")
        return [told.get("value") for told in self.others if told.get("wrote") == name]


class StackClient(Told):
    """The client, at a server: a stack, a folder, a URL, a policy, and name and password."""

    def __init__(
        self, stack: str, folder: Path, url: str, policy: str = "None", *user: str
    ) -> None:
        super().__init__(stack, "client", folder, url, policy, *user)

    def met(self) -> str:
        """Return ``connected``, or the status code or words with which it was refused."""
        told: str = self.next("connected", "refused")
        return "connected" if told.startswith("opc.tcp") else told

    def do(self, act: str, **given: object) -> Any:
        """Let it act; returns the answer."""
        self.tell(do=act, **given)
        return self.next("done", "failed")


class StackLink:
    """What :class:`tests.unit._mailbox_client.MailboxClient` needs of a link, by that client."""

    def __init__(self, client: StackClient, tree: str) -> None:
        self._client, self._tree = client, tree
        self.clock = SystemClock()

    def _values(self, name: str) -> list[int]:
        (got,) = self._client.do("read", nodes=[f"{self._tree}.{name}"])
        assert (got["status"], got["type"]) == ("Good", "UInt16")
        words: list[int] = got["value"]
        return words

    def read_response(self) -> tuple[int, ...]:
        """Return the response block."""
        first, *words, last = self._values("response")
        assert first == last
        return tuple(words)

    def read_slot(self, slot: int) -> tuple[int, ...]:
        """Return a slot."""
        return tuple(self._values("slots")[36 * (slot - 1) : 36 * slot])

    def write_command(self, words: Sequence[int]) -> None:
        """Write the command block."""
        self._write("command", list(words))

    def beat(self, word: int) -> None:
        """Write the heartbeat."""
        self._write("heartbeat", word)

    def _write(self, name: str, value: object) -> None:
        node = f"{self._tree}.{name}"
        done = self._client.do("write", node=node, type="UInt16", value=value)
        assert done == {"status": "Good"}, done
