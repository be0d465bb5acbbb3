"""The machine of the third kind: one line in, one line out, on a loopback socket."""

import socketserver
import threading
from types import TracebackType
from typing import Self

from robolink.controllers import SimpleMachine
from robolink.model import Pose, ToolOffset

_POLLS_PER_MOVE = 2
"""A movement ends after this many polls: no time passes in a test."""


class BenchServer:
    """Serves one machine during the block.

    Attributes:
        machine: The machine behind the socket.
        asked: Every received line.
        url: Its URL.
    """

    def __init__(self) -> None:
        self.machine = SimpleMachine(tools={1: ToolOffset(12.0, -3.5, -20.0)})
        self.asked: list[str] = []
        self._polls_left = 0
        owner = self

        class Handler(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                for line in self.rfile:
                    self.wfile.write(f"{owner.answer(line.decode().strip())}\n".encode())

        self._server = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.url = f"bench+tcp://127.0.0.1:{self._server.server_address[1]}"

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.01,))
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def answer(self, line: str) -> str:
        """Return the answer to a line; ``NO`` and a reason if it is refused."""
        self.asked.append(line)
        name, *words = line.split()
        numbers = [float(word) for word in words]
        machine = self.machine
        if name == "STATUS":
            return "OK ready"
        if name == "TOOL":
            offset = machine.tools.get(int(numbers[0]))
            return "OK" if offset is None else _line(*offset.components())
        if name == "SET":
            machine.tools[int(numbers[0])] = ToolOffset(*numbers[1:])
        elif name == "DROP":
            machine.tools.pop(int(numbers[0]), None)
        elif name == "USE":
            machine.selected = int(numbers[0])
        elif name == "USED":
            return _line(machine.selected)
        elif name == "POSE":
            tip = machine.tip(machine.tool)
            return _line(tip.x_mm, tip.y_mm, tip.z_mm, tip.u_deg)
        elif name == "GO":
            x_mm, y_mm, z_mm, u_deg = numbers
            machine.go(Pose(x_mm, y_mm, z_mm, u_deg))
            self._polls_left = _POLLS_PER_MOVE
        elif name == "MOVING":
            self._polls_left = max(0, self._polls_left - 1)
            return _line(int(self._polls_left > 0))
        elif name == "HALT":
            self._polls_left = 0
        else:
            return "NO unknown"
        return "OK"


def _line(*numbers: float) -> str:
    return " ".join(("OK", *(f"{number:.6f}" for number in numbers)))
