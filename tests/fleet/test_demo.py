"""The product's own agent at twenty simulated cells, killed twice: each is written once."""

import json
import time
from types import SimpleNamespace

import pytest
from robolink_cli import main
from robolink_cli.commands.fleet import rollout
from robolink_cli.commands.fleet.demo import CELLS, X_MM, require_right


@pytest.mark.timeout(240)
@pytest.mark.parametrize("late_s", [0.0, pytest.param(3.0, marks=pytest.mark.soak)])
def test_twenty_cells_are_written_once_each_although_the_agent_is_killed_twice(
    capsys, monkeypatch, late_s
):
    # On a busy computer the person looks at the plan late.
    late = SimpleNamespace(
        monotonic=time.monotonic, sleep=lambda wait_s: time.sleep(wait_s + late_s)
    )
    monkeypatch.setattr(rollout, "time", late)
    assert main.run(["--json", "fleet", "demo"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["kills"] == 2
    assert len(shown["cells"]) == CELLS
    for cell in shown["cells"].values():
        assert (cell["state"], cell["tool_writes"]) == ("unproved", 1)
        assert cell["tool"]["x_mm"] == X_MM


@pytest.mark.parametrize(
    "wrong",
    [{"tool_writes": 2}, {"tool_writes": 0}, {"tool": {"x_mm": 12.5}}, {"state": "unsettled"}],
)
def test_the_demonstration_fails_where_a_cell_is_not_right(wrong):
    right = {"state": "unproved", "tool_writes": 1, "tool": {"x_mm": X_MM}}
    require_right({"cells": {"a": right}})
    with pytest.raises(RuntimeError, match="Not written once: b"):
        require_right({"cells": {"a": right, "b": right | wrong}})
