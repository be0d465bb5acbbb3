"""Nearly valid files are read as written, or refused with a ConfigError."""

import json
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import strategies as st
from robolink_cli.commands.measure.solve.answer import load as load_case
from robolink_cli.commands.measure.solve.answer import solve_document
from robolink_simulators.epson.options import PROFILE_SCHEMA, options_from_text, read_profile
from robolink_simulators.epson.spel.file_commands import read_points
from robolink_simulators.epson.spel.programs.project import read_io_labels
from robolink_simulators.faults import read_fault_file
from robolink_simulators.hosting.replay import read_recording

from robolink.backup import Backup, ToolState, backup_to_text
from robolink.backup import load as load_backup
from robolink.config import check_file
from robolink.errors import CalibrationError, ConfigError
from robolink.model import ControllerFacts, ToolOffset
from robolink.pose_tables import read_poses, read_pts
from robolink.recipe import load_recipe
from robolink.register_maps import draft_from_csv, load_map
from tests.fuzz._mutating import edited_bytes, fuzzed

EXAMPLES = Path(__file__).parents[2] / "examples"
TIP = ToolOffset(12.345, -3.25, -20.002, 90.0)
BACKUP = backup_to_text(
    Backup(
        "epson+tcp://192.168.0.1:5000",
        "2026-01-01T00:00:00+00:00",
        "0.1.0",
        ControllerFacts(robot_number=1, robot_models=("T6-602S",)),
        ToolState(dict.fromkeys(range(1, 16)) | {1: TIP}, 1),
    )
)
CELLS = """
[cells.line3]
url = "epson+tcp://192.168.0.1:5000"
password_env = "ROBOLINK_PASSWORD_LINE3"
timeout_s = 3.0

[cells.line4]
url = "softmotion+modbus-tcp://192.168.0.2?unit=255"
"""
CASE = {
    "method": "n_angle",
    "units": {"length": "mm", "angle": "deg"},
    "input": {"poses": [{"x": 287.5, "y": 103.25, "u": 0}, {"x": 312.5, "y": 96.75, "u": 180}]},
}
CSV = "name,register,type\nTool1_X,40101,REAL\nGVL.T2.x,40105,REAL\nCommit,00001,BOOL\n"
DIALOGUE = (
    '{"schema": "robolink/dialogue/1", "controller": "epson+tcp://a:1", "began_at": "now"}\n'
    '{"t_s": 0.0, "sent": "$GetStatus\\\\r"}\n{"t_s": 0.1, "received": "#GetStatus,0,0\\\\r"}\n'
)
PROFILE = {"schema": PROFILE_SCHEMA, "options": {"terminator": "cr"}}


def solved(path):
    return solve_document(load_case(path))


def profiled(path):
    return options_from_text(dict(read_profile(path)))


PLAN = """
schema = "robolink/faults/1"
link = "epson+tcp"
seed = 3

[[fault]]
action = "drop_reply"
match = "TLSet 2, XY"
on_exchange = 1
"""
POINTS = """ENVT0100,LM:,DS:,CS:,MA:,EI:
sVersion="2.0.0"
nNumberOfPoints=1
Point1 {
\tnNumber=7
\tsLabel="pin"
\tnUndefined=0
\trX=88.952
\trY=233.345
\trZ=-20.062
\trU=-101.024
\trV=0
\trW=0
\tnLocal=0
\tnHand=1
}
"""
LABELS = 'LAB {\nInputBit1 {\n\tnBit=3\n\tsLabel="contact"\n}\n}\n'
KUKA = "DECL E6POS XPIN={X 405.8,Y -62.9,Z 251.6,A 40.0,B 12.0,C -172.0,S 2,T 35}\n"
TABLE = "x_mm,y_mm,z_mm,u_deg\n287.500,103.250,-100.0,0\n312.500,96.750,-100.0,180\n"
GERMAN = "X [mm];Y [mm];Z [mm];U [deg]\n287,500;103,250;-100,0;0\n312,500;96,750;-100,0;180\n"
POSES = {"schema": "robolink/poses/1", "poses": [{"x_mm": 1.5, "y_mm": 2.0, "u_deg": 90.0}]}


READERS = {
    "recipe": (load_recipe, (EXAMPLES / "recipes/scara-pin.toml").read_bytes()),
    "two recipes": (load_recipe, (EXAMPLES / "recipes/nozzle-and-camera.toml").read_bytes()),
    "map": (load_map, (EXAMPLES / "plc-maps/commit-bit.toml").read_bytes()),
    "cells": (check_file, CELLS.encode()),
    "backup": (load_backup, BACKUP.encode()),
    "case": (solved, json.dumps(CASE).encode()),
    "register list": (draft_from_csv, CSV.encode()),
    "dialogue": (read_recording, DIALOGUE.encode()),
    "fault plan": (read_fault_file, PLAN.encode()),
    "points": (read_pts, POINTS.encode()),
    "points of a project": (read_points, POINTS.encode()),
    "labels of a project": (read_io_labels, LABELS.encode()),
    "poses": (read_poses, TABLE.encode()),
    "poses with commas": (read_poses, GERMAN.encode()),
    "poses of another robot": (read_poses, KUKA.encode()),
    "poses as JSON": (read_poses, json.dumps(POSES).encode()),
    "profile": (profiled, json.dumps(PROFILE).encode()),
}


@pytest.fixture(autouse=True, scope="module")
def folder(tmp_path_factory):
    """The folder for the examples; one file, since there are thousands of them."""
    Folder.path = tmp_path_factory.mktemp("fuzz")


class Folder:
    """Set by the fixture; hypothesis passes no fixtures to the functions it calls."""

    path: Path


@pytest.mark.parametrize("kind", sorted(READERS))
def test_the_seed_of_each_kind_is_right(kind):
    read, valid = READERS[kind]
    file = Folder.path / "seed"
    file.write_bytes(valid)
    assert read(file) is not None


@fuzzed(
    30,
    20_000,
    tried=st.sampled_from(sorted(READERS)).flatmap(
        lambda kind: st.tuples(st.just(kind), edited_bytes(READERS[kind][1]))
    ),
)
def test_a_file_that_is_nearly_right_is_read_or_refused(tried):
    kind, content = tried
    file = Folder.path / "tried"
    file.write_bytes(content)
    # Its words may be in the error unchanged: output to the console is escaped. A pose that is not
    # finite is refused as the solvers refuse it.
    with suppress(ConfigError, CalibrationError):
        READERS[kind][0](file)
