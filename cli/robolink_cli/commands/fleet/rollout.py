"""A rollout on simulated cells whose agent is killed: what a demonstration and tests look at."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from robolink.errors import BusyError, ConfigError, LeaseHeldError
from robolink.fleet import FleetStore, HaltRule, JobState, Permit, Plan, PlanProgress, plan_of
from robolink.fleet.errors import PlantError
from robolink.fleet.plans import SCHEMA
from robolink.messages import listed, tr

if TYPE_CHECKING:
    from robolink.model import OutcomeLog

T = TypeVar("T")

TOOL: Final = 1
PLANT: Final = "demo"
_PERSON: Final = "demo"
_PROGRAM: Final = (sys.executable, "-m", "robolink_cli")
_MOST_S: Final = 120.0
"""Longest time without any progress, in s."""


@dataclass(slots=True)
class RolloutCount:
    """What happened during a rollout.

    Attributes:
        kills: How often the agent was killed.
        restarts: How often an agent that had ended by itself was started anew.
        recovered: Cells at which a person had to recover, in that order.
        pauses: How often a person let the next ring begin.
        restart_s: For each kill, seconds from the start of the next agent to its first outcome.
        seconds: How long it took.
    """

    kills: int = 0
    restarts: int = 0
    recovered: list[str] = field(default_factory=list)
    pauses: int = 0
    restart_s: list[float] = field(default_factory=list)
    seconds: float = 0.0


class Rollout:
    """One plan that writes an offset at simulated cells, by an agent that is killed.

    Args:
        folder: Takes the cell file, the record and the plant's database.
        urls: Of the cells, by name.
        x_mm: What is written.
        rings: Of the plan.
        at_once: Of the plan.
        database: The plant's database; a file in the folder unless given.
        program: The words that start ``robolink``, of the n-th agent from 0 on.
        tell: Receives sentences for people.
        window: Of the plan.
        accepts: Rules whose halts the person lifts too, at once.
        restarts: Whether an agent that ends by itself is started anew, as a service is.
        longest_s: Longest time without any progress, in s.
        environment: Further variables of the agent.

    Attributes:
        agent: The process that carries the plan out now.
        journal: File of the cells' record.
    """

    def __init__(
        self,
        folder: Path,
        urls: Mapping[str, str],
        x_mm: float,
        *,
        rings: Sequence[int | str] = (1, 4, "rest"),
        at_once: int = 20,
        database: str = "",
        program: Callable[[int], Sequence[str]] = lambda _life: (
            sys.executable,
            "-m",
            "robolink_cli",
        ),
        tell: Callable[[str], None] = lambda _sentence: None,
        window: str = "",
        accepts: Iterable[HaltRule] = (),
        restarts: bool = False,
        longest_s: float = _MOST_S,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._folder, self._urls, self._x_mm, self._tell = folder, urls, x_mm, tell
        self._rings, self._program, self._lives = list(rings), program, 0
        self._at_once = at_once
        self.database = database or str(folder / "fleet.db")
        self.journal = folder / "state" / "journal.db"
        self.count = RolloutCount()
        self.agent: subprocess.Popen[bytes] | None = None
        self._window, self._restarts, self._longest_s = window, restarts, longest_s
        self._lifts = frozenset({HaltRule.PAUSE, HaltRule.UNSETTLED, *accepts})
        self._environment = dict(environment or {})

    def make(self) -> Plan:
        """Write the cell file, make the plan and permit it."""
        lines = [f"[cells.{name}]\nurl = {json.dumps(url)}\n" for name, url in self._urls.items()]
        (self._folder / "robolink.toml").write_text("\n".join(lines), encoding="utf-8")
        now = datetime.now(UTC)
        table = {
            "schema": SCHEMA,
            "kind": "offset",
            "name": "demo",
            "plant": PLANT,
            "cells": list(self._urls),
            "rings": self._rings,
            "at_once": self._at_once,
            "offsets": {name: {"tool": TOOL, "x_mm": self._x_mm} for name in self._urls},
        }
        if self._window:
            table["window"] = self._window
        plan = plan_of(
            table,
            cells=list(self._urls),
            author=_PERSON,
            made_at=now.isoformat(timespec="milliseconds"),
        )
        with FleetStore(self.database) as store:
            store.add_plan(plan)
            store.give_permit(
                Permit(
                    0,
                    PLANT,
                    _PERSON,
                    "engineer",
                    _label(now - timedelta(days=2)),
                    _label(now + timedelta(days=2)),
                    given_by=_PERSON,
                )
            )
        return plan

    def carry_out(self, plan: Plan, kill_now: Callable[[PlanProgress], bool]) -> PlanProgress:
        """Have an agent carry a plan out to its end; be the person whom it waits for.

        Args:
            plan: The plan.
            kill_now: Called at each look; says whether the agent is to be killed. It may do
                anything else to it, too, and take its time.
        """
        begun_s = seen_s = started_s = time.monotonic()
        ended = awaited = 0
        with FleetStore(self.database) as store:
            self.agent = self.start_agent()
            try:
                while True:
                    progress = _answered(lambda: store.progress(plan.id), self._longest_s)
                    now_s = time.monotonic()
                    over = sum(job.state.final for job in progress.jobs)
                    if over != ended:
                        if awaited:
                            self.count.restart_s.append(now_s - started_s)
                        ended, seen_s, awaited = over, now_s, 0
                    if progress.finished and not progress.standing:
                        break
                    if progress.standing:
                        self._be_the_person(store, progress)
                        seen_s = time.monotonic()
                    elif self._fell(lambda: kill_now(progress)):  # noqa: B023 - called at once
                        self.agent = self.start_agent()
                        started_s = seen_s = time.monotonic()
                        awaited = 1
                    elif now_s - seen_s > self._longest_s or self._ended():
                        log = (self._folder / "agent.log").read_text(errors="replace")
                        raise RuntimeError(tr("The agent does not go on. {log}", log=log[-2000:]))
                    else:  # what was done to it meanwhile is no silence of its own
                        seen_s += time.monotonic() - now_s
                    time.sleep(0.05 + len(self._urls) / 10_000)
            finally:
                self._kill()
        self.count.seconds = time.monotonic() - begun_s
        return progress

    def start_agent(self) -> subprocess.Popen[bytes]:
        """Start an agent of the plant, the present one or another beside it."""
        environment = {
            **os.environ,
            **self._environment,
            "ROBOLINK_CONFIG": str(self._folder / "robolink.toml"),
            "ROBOLINK_PLANT": self.database,
            "ROBOLINK_STATE_DIR": str(self._folder / "state"),
        }
        environment.pop("ROBOLINK_JOURNAL", None)
        command = [*self._program(self._lives), "fleet", "agent", PLANT]
        self._lives += 1
        with (self._folder / "agent.log").open("ab") as log:
            return subprocess.Popen(
                command,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    def _fell(self, kill_now: Callable[[], bool]) -> bool:
        """Whether the agent was killed, here or by itself, or ended and is to be replaced."""
        if kill_now() or (self.agent is not None and self.agent.poll() == -signal.SIGKILL):
            self._kill()
            self.count.kills += 1
            return True
        if self._restarts and self._ended():
            self.count.restarts += 1
            return True
        return False

    def _ended(self) -> bool:
        return self.agent is None or self.agent.poll() is not None

    def _kill(self) -> None:
        agent, self.agent = self.agent, None
        if agent is not None:
            agent.kill()
            agent.wait()

    def _be_the_person(self, store: FleetStore, progress: PlanProgress) -> None:
        """Do what a halted plan waits for, and let it go on."""
        rules = {halt.rule for halt in progress.standing}
        if rules - self._lifts:
            said = [
                f"{job.cell}: {job.what}" for job in progress.jobs if job.state.final and job.what
            ]
            raise RuntimeError(
                listed(tr("The plan is halted: {rules}.", rules=", ".join(sorted(rules))), said)
            )
        unsettled = [job.cell for job in progress.jobs if job.state is JobState.UNSETTLED]
        for cell in unsettled:  # one that was cut off may have its cell for a while still
            _answered(lambda: self._recover(cell), self._longest_s)  # noqa: B023 - called at once
        self.count.recovered += unsettled
        self.count.pauses += HaltRule.PAUSE in rules
        reason = tr("recovered: {cells}", cells=", ".join(unsettled)) if unsettled else tr("looked")
        if unsettled:
            self._tell(reason)
        _answered(lambda: store.resume(progress.plan.id, _PERSON, reason), self._longest_s)

    def _recover(self, cell: str) -> None:
        import robolink
        from robolink.transaction import recover

        with robolink.connect(self._urls[cell], outcomes=self._record(cell)) as controller:
            if controller.status().needs_reset:  # its client was silent for too long
                controller.reset_fault()
            left = recover(controller).left
        if left:
            raise ConfigError(
                tr("{cell} cannot be recovered without a person.", cell=cell),
                remedy=tr("Run: robolink fleet demo"),
            )

    def _record(self, cell: str) -> "OutcomeLog":
        from robolink import __version__
        from robolink.journal import open_journal, signature_here
        from robolink.transport import parse_url

        journal = open_journal(str(self.journal))
        address = parse_url(self._urls[cell]).address
        return journal.log(address, signature=signature_here(__version__))


def _answered(ask: Callable[[], T], longest_s: float) -> T:
    """Ask the plant's database, or a cell, until it answers, as a person would."""
    until = time.monotonic() + longest_s
    while True:
        try:
            return ask()
        except (PlantError, LeaseHeldError, BusyError):
            if time.monotonic() > until:
                raise
            time.sleep(0.5)


def _label(at: datetime) -> str:
    return at.isoformat(timespec="seconds")
