"""Files that are nearly right: read as they are written, or refused by a ConfigError."""

import json
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import strategies as st
from robolink_cli.commands.measure.solve.solving import load as load_case
from robolink_cli.commands.measure.solve.solving import solve_document
from robolink_simulators.epson.options import PROFILE_SCHEMA, options_from_text, read_profile
from robolink_simulators.hosting.replay import read_recording

from robolink.backup import Backup, ToolState, backup_to_text
from robolink.backup import load as load_backup
from robolink.config import check_file
from robolink.errors import ConfigError
from robolink.model import ControllerFacts, ToolOffset
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


READERS = {
    "recipe": (load_recipe, (EXAMPLES / "recipes/scara-pin.toml").read_bytes()),
    "two recipes": (load_recipe, (EXAMPLES / "recipes/nozzle-and-camera.toml").read_bytes()),
    "map": (load_map, (EXAMPLES / "plc-maps/commit-bit.toml").read_bytes()),
    "cells": (check_file, CELLS.encode()),
    "backup": (load_backup, BACKUP.encode()),
    "case": (solved, json.dumps(CASE).encode()),
    "register list": (draft_from_csv, CSV.encode()),
    "dialogue": (read_recording, DIALOGUE.encode()),
    "profile": (profiled, json.dumps(PROFILE).encode()),
}


@pytest.fixture(autouse=True, scope="module")
def folder(tmp_path_factory):
    """Where each example is written; one file, since there are thousands of them."""
    Folder.path = tmp_path_factory.mktemp("fuzz")


class Folder:
    """Set by the fixture; hypothesis hands none to what it calls."""

    path: Path


@pytest.mark.parametrize("kind", sorted(READERS))
def test_the_seed_of_each_kind_is_right(kind):
    read, valid = READERS[kind]
    file = Folder.path / "seed"
    file.write_bytes(valid)
    assert read(file) is not None


@fuzzed(
    100,
    20_000,
    tried=st.sampled_from(sorted(READERS)).flatmap(
        lambda kind: st.tuples(st.just(kind), edited_bytes(READERS[kind][1]))
    ),
)
def test_a_file_that_is_nearly_right_is_read_or_refused(tried):
    kind, content = tried
    file = Folder.path / "tried"
    file.write_bytes(content)
    # Its words may stand in the error as they are: what is shown is escaped at the console's door.
    with suppress(ConfigError):
        READERS[kind][0](file)
