"""The ways of a tool write to the wire, and of poses to the solver, grow no longer unnoticed.

docs/decisions/0023-how-short-the-way-of-a-tool-write-is.md says what the figures mean.
"""

from pathlib import Path

import pytest

from tests.packaging._way_to_the_wire import (
    follow_a_tool_write,
    follow_into_the_simulator,
    follow_typed_poses,
)
from tools import house

MOST_FILES = {"set_tool": 84, "change_tools": 42}
MOST_CALLS = 13
MOST_FILES_OPEN = 9
MOST_FILES_TO_SOLVE = 8
MOST_FILES_OPEN_FROM_THE_POSES = 5
MOST_FILES_OPEN_FROM_THE_COMMAND = 9


@pytest.fixture
def way(epson_tcp, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    return follow_a_tool_write(epson_tcp.url)


@pytest.fixture(scope="module")
def told():
    return house.told(house.PAGE.read_text(encoding="utf-8"))[1]


def test_a_tool_write_passes_through_no_more_files_than_are_known(way, told):
    files = sorted(way.of_the_library("run"))
    assert len(files) <= told["`tool set` to its bytes"], files
    opened = {file for file, _ in way.stack[-MOST_CALLS + 1 :]}
    for name, most in MOST_FILES.items():
        files = sorted(way.entered[name])
        assert opened <= set(files)
        assert len(files) <= most, f"{len(files)} files from {name}() on: {files}"


def test_what_is_open_when_the_request_leaves_can_be_read_from_top_to_bottom(way):
    functions = [function for _, function in way.stack]
    calls = way.stack[functions.index("set_tool") :]
    assert len(calls) <= MOST_CALLS, calls
    assert len({file for file, _ in calls}) <= MOST_FILES_OPEN, calls
    page = Path(__file__).parents[2] / "docs" / "architecture.md"
    told = page.read_text(encoding="utf-8")
    assert [file for file, _ in calls if f"`{file}`" not in told] == []


def test_typed_poses_pass_through_no_more_files_than_are_known(epson_tcp, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    way = follow_typed_poses(epson_tcp.url)
    files, opened = sorted(way.entered["solve"]), {file for file, _ in way.stack}
    assert "robolink/calibration/pin/two_pose.py" in opened
    assert len(files) <= MOST_FILES_TO_SOLVE, files
    assert len(opened) <= MOST_FILES_OPEN_FROM_THE_POSES, way.stack
    assert len({file for file, _ in way.command}) <= MOST_FILES_OPEN_FROM_THE_COMMAND, way.command
    page = Path(__file__).parents[2] / "docs" / "architecture.md"
    told = page.read_text(encoding="utf-8")
    assert [file for file in sorted({*files, *opened}) if f"`{file}`" not in told] == []


def test_a_request_passes_through_no_more_files_of_the_simulator_than_are_known(told):
    entered = sorted(follow_into_the_simulator().entered["receive"])
    assert "simulators/robolink_simulators/epson/memory/tools.py" in entered
    assert len(entered) <= told["a request to the simulator's `TLSet`"], entered


@pytest.mark.soak
def test_a_recipe_passes_through_no_more_files_than_are_known(told, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROBOLINK_STATE_DIR", str(tmp_path))
    way = "a recipe to its first movement"
    assert house.walks()[way] <= told[way]
