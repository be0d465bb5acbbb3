"""A process that runs an engine until it is killed: its jobs write down when they begin and end.

    python -m tests.fleet._engine_process URL FOLDER WORKERS ORDER...

A line of FOLDER/log is ``begin ORDER`` or ``end ORDER``. A job whose order ends in ``stays`` goes
on until FOLDER/go exists.
"""

import os
import sys
import time
from pathlib import Path

from robolink.fleet.engine import Engine


def main(url: str, folder: Path, workers: int, orders: list[str]) -> None:
    log = os.open(folder / "log", os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)

    def carry_out(order: str) -> None:
        os.write(log, f"begin {order}\n".encode())
        while order.endswith("stays") and not (folder / "go").exists():
            time.sleep(0.005)
        os.write(log, f"end {order}\n".encode())

    engine = Engine(url, "plant", carry_out, workers=workers)
    engine.start()
    engine.hand_out({order: order for order in orders})
    while True:
        engine.wait_for_news(60.0)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4:])
