"""How long a check of many cells takes: ``python -m tests.soak.check_many_cells 2000``.

``sim run`` serves the cells from one process, and ``robolink check`` checks them, both over real
sockets. Some cells may be off: half of those refuse the connection, half do not answer at all. It
prints seconds, CPU time of both, and the load of the machine.
"""

import argparse
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from pathlib import Path

ROBOLINK = (sys.executable, "-m", "robolink_cli")


def cpu_of(pid: int) -> float:
    """Return the CPU time of a process, in s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def silent_port(stack: ExitStack) -> int:
    """Return a port that takes no connection and refuses none: its queue is full."""
    listening = stack.enter_context(socket.socket())
    listening.bind(("127.0.0.1", 0))
    listening.listen(0)
    for _ in range(2):
        waiting = stack.enter_context(socket.socket())
        waiting.setblocking(False)
        waiting.connect_ex(listening.getsockname())
    return int(listening.getsockname()[1])


def checked(env: dict[str, str], server: int, times: int) -> Counter[str]:
    """Check the cells so often, print how long each takes, and return how the last one ended."""
    states: Counter[str] = Counter()
    for number in range(times):
        begun_s, served_s = time.monotonic(), cpu_of(server)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        line = [*ROBOLINK, "--json", "check"]
        ended = subprocess.run(line, env=env, stdout=subprocess.PIPE, check=False)
        took_s, after = time.monotonic() - begun_s, resource.getrusage(resource.RUSAGE_CHILDREN)
        client_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        states = Counter(cell["state"] for cell in json.loads(ended.stdout)["cells"])
        sys.stdout.write(
            f"run {number + 1}: {took_s:.1f} s, exit {ended.returncode}, {dict(states)}; "
            f"CPU: check {client_s:.1f} s, simulators {cpu_of(server) - served_s:.1f} s; "
            f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores\n"
        )
        sys.stdout.flush()
    return states


def run(cells: int, off: int, times: int) -> Counter[str]:
    """Serve cells, check them, and return how the last check ended."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        table = f'schema = "robolink/sim-cells/1"\n[cells.press]\nkind = "epson"\ncount = {cells}\n'
        (folder / "cells.toml").write_text(f'{table}tcp = "127.0.0.1:0"\n')
        served = [*ROBOLINK, "--json", "sim", "run", str(folder / "cells.toml"), "--wait-ready"]
        about = json.loads(subprocess.run(served, stdout=subprocess.PIPE, check=True).stdout)
        stack.callback(os.kill, about["pid"], signal.SIGTERM)
        refusing, silent = "epson+tcp://127.0.0.1:1", silent_port(stack)
        with (folder / "robolink.toml").open("w") as file:
            for number, (name, cell) in enumerate(about["cells"].items()):
                url = cell["url"]
                if number < off:  # the first ones, where they would cost the others most
                    url = refusing if number % 2 else f"epson+tcp://127.0.0.1:{silent}"
                file.write(f'[cells.{name}]\nurl = "{url}"\n')
        env = os.environ | {
            "ROBOLINK_CONFIG": str(folder / "robolink.toml"),
            "ROBOLINK_STATE_DIR": str(folder / "state"),
        }
        return checked(env, about["pid"], times)


def main() -> None:
    """Read the arguments, and run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cells", type=int, nargs="?", default=2000)
    parser.add_argument("--off", type=int, default=0, help="how many of them are off")
    parser.add_argument("--times", type=int, default=2, help="the first check meets all cells")
    given = parser.parse_args()
    run(given.cells, given.off, given.times)


if __name__ == "__main__":
    main()
