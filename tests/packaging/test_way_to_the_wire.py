"""The way of a tool write to the wire grows no longer unnoticed.

docs/decisions/0023-how-short-the-way-of-a-tool-write-is.md says what the figures mean.
"""

from pathlib import Path

import pytest

from tests.packaging._way_to_the_wire import follow_a_tool_write

MOST_FILES = {"set_tool": 75, "change_tools": 40}
MOST_CALLS = 14
MOST_FILES_OPEN = 9


@pytest.fixture
def way(epson_tcp, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    return follow_a_tool_write(epson_tcp.url)


def test_a_tool_write_passes_through_no_more_files_than_are_known(way):
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
