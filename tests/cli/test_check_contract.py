"""check-contract: what a controller promises, looked at and changed by nothing."""

import json
from itertools import count
from typing import cast

from robolink_cli import main

from robolink.model import Controller, ToolOffset
from robolink.testing import MemoryController, MemoryMachine, Subject, outcomes
from tests.contract.test_third_kind import install
from tests.contract.third_kind.bench_server import BenchServer


def test_a_controller_that_keeps_its_promises_is_only_looked_at(run, simulator):
    before = simulator.truth()
    code, out, _ = run("--json", "expert", "check-contract")
    told = json.loads(out)
    assert (code, told["schema"], told["kept"]) == (0, "robolink/contract/1", True)
    assert len(told["checks"]) == 8
    assert all(one["promise"].endswith(".") and one["broken"] is None for one in told["checks"])
    after = simulator.truth()
    assert after == before
    assert simulator.counters()["tool_writes"] == 0
    assert simulator.counters()["moves_started"] == 0
    code, out, _ = run("expert", "check-contract")
    assert "All 8 promises" in out


class Drifting(dict[int, ToolOffset]):
    """Tools that are others whenever somebody looks."""

    looks = count()

    def get(self, tool: int, other: object = None) -> ToolOffset:
        return ToolOffset(float(next(self.looks)))


def test_a_driver_of_ones_own_that_breaks_a_promise_is_told_by_name(monkeypatch, capsys):
    install(monkeypatch, ("bench", "bench_package.bench_controller:open_bench"))
    with BenchServer() as server:
        server.machine.tools = Drifting()
        code = main.run(["-c", server.url, "--json", "expert", "check-contract"])
        told = json.loads(capsys.readouterr().out)
        assert main.run(["-c", server.url, "expert", "check-contract"]) == 1
    broken = {one["name"]: one["broken"] for one in told["checks"] if one["broken"]}
    assert (code, told["kept"]) == (1, False)
    assert broken == {"tools_are_read_by_number": "read() and read_all() agree"}
    assert "1 of 8 promises are broken" in capsys.readouterr().out


def test_each_promise_is_told_how_it_was_found():
    names = count()

    def changeling() -> Controller:
        identity = f"memory+object://machine-{next(names)}"
        return cast("Controller", MemoryController(MemoryMachine(), identity=identity))

    found = {one.name: one for one in outcomes(Subject(changeling))}
    assert "each connection" in found["who_it_is_is_the_same_each_time"].broken
    assert [name for name, one in found.items() if one.broken] == [
        "who_it_is_is_the_same_each_time"
    ]
