"""Cells at which plans that move robots are carried out, and the people who agree to them."""

import io
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from robolink_cli.prompts import operator as _operator
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.hosting.streams.epson import serve_tcp

from robolink.fleet import FleetStore, Permit, Plan, plan_of
from robolink.model import Pose, ToolOffset, rotate_xy
from robolink.runner import Question
from tests._commands import Ended, run_command

PIN = (300.0, 100.0, -60.0)
OLD = ToolOffset(12.0, -3.5, -20.0)
NEW = ToolOffset(12.3, -3.4, -20.0)

RECIPE = """
schema = "robolink/recipe/1"
name = "points"
basis = "absolute"
z = "kept"
[source]
kind = "points"
[station]
id = "PIN"
[[tools]]
number = 1
points = [{first}, {second}]
"""
"""A change by points that were taught on the pin; nothing moves, so that it takes no time."""


class TerminalStream(io.StringIO):
    """A stream that counts as a terminal."""

    def isatty(self) -> bool:
        return True


class PersonAtCell:
    """Answers what a command asks at its terminal.

    Args:
        answers: Said in turn; the last one to all that follows.

    Attributes:
        asked: The questions.
        before: Called before each answer, with its number from 1.
    """

    def __init__(self, *answers: str) -> None:
        self._answers = list(answers or ("y",))
        self.asked: list[str] = []
        self.before = lambda _number: None

    def tell(self, text: str) -> None:
        """Hear a sentence."""

    def ask(self, question: str, _kind: Question) -> None:
        """Hear a question."""
        self.asked.append(question)

    def poll(self, _wait_s: float) -> str:
        """Answer."""
        self.before(len(self.asked))
        return self._answers.pop(0) if self._answers[1:] else self._answers[0]

    def run(self, cell: str, *words: str) -> Ended:
        """Type ``robolink -c CELL fleet next`` at a terminal."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "stdin", TerminalStream())
            patch.setattr(_operator, "terminal", lambda: self)
            return run_command("-c", cell, "fleet", "next", *words, err=TerminalStream())


def teach(simulator: EpsonSimulator, tip: ToolOffset, points: Sequence[int] = (901, 902)) -> None:
    """Teach two points on the pin with a tip, in Tool 0."""
    for number, u_deg in zip(points, (10.0, -170.0), strict=True):
        x, y = rotate_xy(tip.x_mm, tip.y_mm, u_deg)
        pose = Pose(PIN[0] - x, PIN[1] - y, PIN[2] - tip.z_mm, u_deg)
        simulator.machine.points.store(number, Point.at(pose))


class MovingCells:
    """Simulated cells in cell files, and a plan for them.

    Attributes:
        simulators: By the names of the cells.
        store: The plant's database.
    """

    def __init__(self, folder: Path, simulators: dict[str, EpsonSimulator], plant: str) -> None:
        self.folder, self.simulators = folder, simulators
        self.store = FleetStore(plant)
        self._written = {name: one.machine.flash_writes for name, one in simulators.items()}
        urls = [
            f"[cells.{name}]\nurl = {json.dumps(one.url)}\nremote_timeout_s = 60.0\n"
            'remote_timeout_confirmed_by = "a test"\n'
            for name, one in simulators.items()
        ]
        (folder / "robolink.toml").write_text("".join(urls))
        (folder / "needle.toml").write_text(RECIPE.format(first=901, second=902))

    def plan(
        self,
        *,
        starts: bool = True,
        permitted: bool = True,
        homes: Mapping[str, str] | None = None,
        **keys: object,
    ) -> Plan:
        """Keep a plan for all cells, with a permit for Chen."""
        table: dict[str, object] = {
            "schema": "robolink/fleet-plan/1",
            "kind": "recipe",
            "name": "needles",
        }
        table |= {"cells": list(self.simulators), "recipe": "needle.toml", "rings": [1, 4, "rest"]}
        made = plan_of(
            {**table, **keys},
            cells=list(self.simulators),
            homes=homes,
            path=self.folder / "plan.toml",
        )
        self.store.add_plan(made, starts=starts)
        if permitted:
            self.permit(made)
        return made

    def permit(self, plan: Plan) -> Permit:
        now = datetime.now(UTC)
        labels = [(now + timedelta(days=days)).isoformat(timespec="seconds") for days in (-1, 1)]
        return self.store.give_permit(Permit(0, plan.plant, "Chen", "engineer", *labels))

    def job(self, plan: Plan, cell: str):
        """Return a cell's job as it is on record."""
        return next(one for one in self.store.progress(plan.id).jobs if one.cell == cell)

    def tool(self, cell: str) -> ToolOffset | None:
        """Return tool 1, past the wire."""
        return self.simulators[cell].machine.tools.get(1)

    def writes(self, cell: str) -> int:
        """Return how often a tool was written, as the controller counts."""
        return self.simulators[cell].machine.flash_writes - self._written[cell]


@contextmanager
def moving_cells(folder: Path, plant: str, *names: str) -> Iterator[MovingCells]:
    """Serve cells with an old value in tool 1 and points taught with the new tip."""
    with ExitStack() as stack:
        simulators = {}
        for seed, name in enumerate(names, start=1):
            simulator = EpsonSimulator("T6-602S", seed=seed)
            stack.enter_context(serve_tcp(simulator))
            simulator.machine.tools.set(1, OLD)
            simulator.machine.tools.select(1)
            teach(simulator, NEW)
            simulators[name] = simulator
        cells = MovingCells(folder, simulators, plant)
        stack.callback(cells.store.close)
        yield cells
