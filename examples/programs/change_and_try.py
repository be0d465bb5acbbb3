"""Write new offsets, make a test part, and keep the offsets only if the part is good.

    python change_and_try.py line3 offsets.json -- ./measure_part.sh 20260412-7

offsets.json: {"1": {"x_mm": 12.3, "y_mm": -3.7, "z_mm": -20.0}, "2": ...}. The command makes the
part and ends with 0 where it is good; anything else, Ctrl-C too, puts all old values back. Exit
codes: 0 kept, 1 part not good, 2 not done, 6 run 'robolink recover', 130 Ctrl-C, 143 SIGTERM.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from signal import Signals

from robolink import Controller, RobolinkError, ToolOffset, connect
from robolink.config import find_cell
from robolink.controller_outcome import outcome_after
from robolink.errors import OutcomeUnknownError
from robolink.interrupts import Interrupted, one_ending
from robolink.transaction import ToolChange, Wanted


def offsets_of(path: Path) -> dict[int, ToolOffset]:
    """Read the file of offsets; ValueError says what is wrong with it."""
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))
        offsets = {int(tool): ToolOffset(**offset) for tool, offset in rows.items()}
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"{path}: {error} (--help shows the form)") from error
    if not offsets:
        raise ValueError(f"{path} names no tool")
    return offsets


def part_is_good(controller: Controller, command: Sequence[str]) -> bool:
    """Make and measure the part; what ends this program ends the command too."""
    part = subprocess.Popen(command)
    try:
        while part.poll() is None:
            controller.status()  # EPSON logs a client out that is silent for 60 s
            time.sleep(0.2)
        return part.returncode == 0
    finally:
        part.kill()


def change(controller: Controller, offsets: dict[int, ToolOffset], command: Sequence[str]) -> bool:
    """Write all, try, and keep or put back; return whether the new values stay."""
    wanted = [Wanted(tool, new, controller.tools.read(tool)) for tool, new in offsets.items()]
    with ToolChange(controller, wanted, verify=True, tell=print) as tried:
        tried.write()  # it compares first: nothing is written if a tool was changed meanwhile
        if part_is_good(controller, command):
            tried.keep(f"the part was good: {' '.join(command)}")
    return tried.kept


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(usage=__doc__)
    for name, count in (("cell", None), ("offsets", None), ("command", "+")):
        parser.add_argument(name, nargs=count)
    given, password = parser.parse_args(words), os.environ.get("ROBOLINK_PASSWORD")
    try:
        with one_ending():
            offsets, cell = offsets_of(Path(given.offsets)), find_cell(given.cell)
            with connect(cell.url, password=password, limits=cell.limits()) as controller:
                return 0 if change(controller, offsets, given.command) else 1
    except (Interrupted, RobolinkError, OSError, ValueError) as error:
        print(f"change_and_try.py: {error}", file=sys.stderr)
        if isinstance(error, OutcomeUnknownError) or not outcome_after(error).settled:
            return 6
        return 128 + Signals[error.by.value] if isinstance(error, Interrupted) else 2


if __name__ == "__main__":
    sys.exit(main())
