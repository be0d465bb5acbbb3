"""``robolink`` on a computer whose clock is wrong: set anew whenever a file says so.

    python -m tests.fleet._wrong_clock FILE ARGUMENT...

The file holds the seconds by which the wall clock is ahead. Monotonic time goes on as ever.
"""

import sys
import time
from pathlib import Path

real = time.time


def wrong_by(file: Path) -> None:
    """Have this process read the wall clock so."""

    def read() -> float:
        return real() + float(file.read_text() or 0)

    time.time = read


if __name__ == "__main__":
    wrong_by(Path(sys.argv[1]))
    del sys.argv[1]
    from robolink_cli.entry import main  # behind the clock, which modules bind

    main()
