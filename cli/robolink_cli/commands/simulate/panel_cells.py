"""The simulated cells of ``panel --demo``: three kinds of controllers, in a folder of their own."""

import json
import secrets
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from robolink_simulators.control.client import ControlClient

from robolink.errors import ConnectError
from robolink.messages import tr
from robolink_cli.commands.shipped.shipped_files import maps_folder, recipes_folder

_SIMULATED: Final = """\
schema = "robolink/sim-cells/1"

[cells.scara]
kind = "epson"
tcp = "127.0.0.1:0"
robot = "T6-602S"
speed = 2
camera = "127.0.0.1:0"

[cells.tilting]
kind = "softmotion"
tcp = "127.0.0.1:0"
kinematics = "Kin_5Axes"
speed = 2

[cells.dispenser]
kind = "plc"
tcp = "127.0.0.1:0"
map = "dispenser.map.toml"
"""

_RECIPES: Final = {
    "scara": ("scara", "scara-pin"),
    "scara-camera": ("scara", "pick-nozzle-camera"),
    "tilting": ("tilting", "five-axes-pivot"),
}
"""By its name here: the cell that a recipe is for, and the shipped one that it is a copy of."""

_MAP: Final = "commit-bit.toml"
_END_S: Final = 10.0


@dataclass(frozen=True, slots=True)
class DemoCells:
    """Simulated cells that are served beside this process.

    Attributes:
        folder: Where all that belongs to them is; it goes with them.
        cells_file: Their cell file.
        state: Folder for what is on record of them.
        assists: Where the person at each cell is asked, by its name.
        pin: For moving and writing on their pages.
        pid: Number of the process that serves them.
    """

    folder: Path
    cells_file: Path
    state: Path
    assists: dict[str, str]
    pin: str
    pid: int

    def payload(self) -> dict[str, object]:
        """Return what a script needs of it, as plain JSON."""
        return {"pin": self.pin, "state_dir": str(self.state), "assists": self.assists}


@contextmanager
def demo_cells() -> Iterator[DemoCells]:
    """Serve simulated cells of three kinds for the block, in a folder that goes at its end.

    Raises:
        ConnectError: They cannot be served.
    """
    folder = Path(tempfile.mkdtemp(prefix="robolink-panel-"))
    try:
        simulated = folder / "simulated.toml"
        simulated.write_text(_SIMULATED, encoding="utf-8")
        (folder / "dispenser.map.toml").write_bytes((maps_folder() / _MAP).read_bytes())
        with _served(simulated) as (document, pid):
            cells = document["cells"]
            rows: list[str] = []
            for name, about in cells.items():
                rows += [f"[cells.{name}]", f"url = {json.dumps(about['url'])}"]
                rows += [*_SETTINGS.get(name, ()), ""]
                if "camera" in about:
                    rows += [*_camera_rows(name, about), ""]
            cells_file = folder / "robolink.toml"
            cells_file.write_text("\n".join(rows), encoding="utf-8")
            for name, (cell, recipe) in _RECIPES.items():
                text = (recipes_folder() / f"{recipe}.toml").read_text(encoding="utf-8")
                ours = text.replace("\nbasis = ", f'\ncells = ["{cell}"]\nbasis = ', 1)
                (folder / f"{name}.toml").write_text(ours, encoding="utf-8")
            assists = {name: one["assist"] for name, one in cells.items() if "assist" in one}
            yield DemoCells(folder, cells_file, folder / "state", assists, _pin(), pid)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _pin() -> str:
    """Return a PIN, drawn anew each time, that is no series."""
    return f"{10**5 + secrets.randbelow(9 * 10**5)}{secrets.randbelow(5)}9"


_SETTINGS: Final = {
    "scara": (
        'robot = "T6-602S"',
        "tool = 1",
        "remote_timeout_s = 60.0",
        'remote_timeout_confirmed_by = "the simulator"',
    ),
    "tilting": ("tool = 1",),
}
"""What the cell file says of each, beside its address."""


def _camera_rows(cell: str, about: dict[str, Any]) -> list[str]:
    """Return what the cell file says of a cell's camera: that of the recipe for it."""
    with ControlClient(about["control"]) as control:
        x_mm, y_mm, z_mm = control.do("truth")["camera"]["middle_mm"]
    return [
        f"[cells.{cell}.stations.CAM-01]",
        'kind = "camera"',
        f"sensor = {json.dumps(about['camera']['url'])}",
        f"x_mm = {x_mm}",
        f"y_mm = {y_mm}",
        f"z_mm = {z_mm}",
        "diameter_mm = 1.0",
    ]


@contextmanager
def _served(simulated: Path) -> "Iterator[tuple[dict[str, dict[str, Any]], int]]":
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "robolink_cli", "--json", "sim", "run", str(simulated)),
            *(("--with-parent",) if sys.platform != "win32" else ()),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        start_new_session=True,  # Ctrl-C is for the panel, whose jobs end first
    )
    try:
        assert process.stdout is not None  # noqa: S101 - it was asked for
        try:
            document = json.loads(process.stdout.readline())
        except ValueError:
            document = {}
        if "cells" not in document:
            raise ConnectError(
                tr("The simulated cells could not be started."),
                remedy=tr("To see why: robolink demo"),
            )
        yield document, process.pid
    finally:
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.wait(_END_S)
        if process.poll() is None:
            process.kill()
            process.wait()
