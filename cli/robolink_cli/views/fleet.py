"""Plans of many cells, their jobs, halts and permits: for people and as JSON."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

from robolink.fleet import (
    CellJob,
    CellState,
    Halt,
    JobState,
    Permit,
    PlanOverview,
    PlanProgress,
    PlantHome,
    WaitReason,
    state_in_words,
    wait_in_words,
)
from robolink.messages import tr
from robolink.model import json_fields
from robolink.timing import local_label
from robolink_cli.console.render import say, say_listed, table

_FOR_A_PERSON: Final = (JobState.UNSETTLED, JobState.REFUSED, JobState.MISSED)
_MOST_LISTED: Final = 20
_SHOWN_DIGITS: Final = 12


def halts_in_words(halts: Sequence[Halt]) -> list[str]:
    """Return a line for each of several halts, with its number; one alone needs none."""
    if len(halts) == 1:
        return [halts[0].sentence]
    return [tr("halt {number}: {why}", number=halt.number, why=halt.sentence) for halt in halts]


def halt_payload(halt: Halt) -> dict[str, object]:
    """Return a halt as plain JSON."""
    return {
        **json_fields(halt, "number", "at"),
        "rule": str(halt.rule),
        "cell": halt.cell or None,
        "numbers": dict(halt.numbers),
        "by": halt.by or None,
        "lifted_at": halt.lifted_at or None,
        "lifted_by": halt.lifted_by or None,
        "reason": halt.reason or None,
        "sentence": halt.sentence,
    }


def permit_payload(permit: Permit) -> dict[str, object]:
    """Return a permit as plain JSON."""
    return {
        **json_fields(permit, "number", "plant", "person", "role", "from_at", "until_at"),
        "group": permit.group or None,
        "plan": permit.plan or None,
        **json_fields(permit, "given_by", "given_at"),
        "revoked_by": permit.revoked_by or None,
        "revoked_at": permit.revoked_at or None,
    }


def home_payload(home: PlantHome) -> dict[str, object]:
    """Return a home as plain JSON."""
    return {
        **json_fields(home, "plant", "home"),
        "heard_at": home.heard_at or None,
        "agent": home.agent or None,
    }


def plans_payload(
    overviews: Iterable[PlanOverview], homes: Iterable[PlantHome] = ()
) -> dict[str, object]:
    """Return plans in a line each, and the homes whose agents were heard, as plain JSON."""
    return {
        "homes": [home_payload(home) for home in homes],
        "plans": [
            {
                "plan": one.plan.id,
                "kind": str(one.plan.kind),
                **json_fields(one.plan, "name", "plant", "author", "made_at"),
                "cell_count": len(one.plan.cells),
                "finished": one.finished,
                "cancelled_at": one.cancelled_at or None,
                "states": states_payload(one.counts),
                "halts": [halt_payload(halt) for halt in one.standing],
            }
            for one in overviews
        ],
    }


def show_plans(overviews: Iterable[PlanOverview], homes: Iterable[PlantHome] = ()) -> None:
    """Print a line a plan, and a line a home."""
    rows = [
        (
            one.plan.id,
            f"{one.plan.kind}: {one.plan.name}",
            local_label(one.plan.made_at),
            _counted(one.counts),
            _standing(one),
        )
        for one in overviews
    ]
    if not rows:
        say(tr("No plan was made yet: robolink fleet plan FILE"))
        return
    table(tr("Plans"), (tr("plan"), tr("kind"), tr("made"), tr("jobs"), ""), rows)
    heard = [(one.home, one.plant, local_label(one.heard_at), one.agent) for one in homes]
    if heard:
        table(tr("Homes"), (tr("home"), tr("plant"), tr("last heard"), tr("agent")), heard)


def _standing(one: PlanOverview) -> str:
    if one.cancelled_at:
        return tr("cancelled")
    if one.standing:
        return " ".join(halt.sentence for halt in one.standing)
    return tr("finished") if one.finished else ""


def progress_payload(progress: PlanProgress) -> dict[str, object]:
    """Return how a plan stands as plain JSON, with all its jobs."""
    plan = progress.plan
    return {
        "plan": plan.id,
        "kind": str(plan.kind),
        **json_fields(plan, "name", "plant", "author", "made_at"),
        "recipe": plan.recipe or None,
        "recipe_hash": plan.recipe_hash or None,
        "finished": progress.finished,
        "cancelled_at": progress.cancelled_at or None,
        "states": states_payload(progress.counts()),
        "rings": [states_payload(ring) for ring in progress.rings()],
        "halts": [halt_payload(halt) for halt in progress.halts],
        "homes": [home_payload(home) for home in progress.homes.values()],
        "jobs": [_job(progress, job) for job in progress.jobs],
    }


def job_payload(progress: PlanProgress, job: CellJob) -> dict[str, object]:
    """Return one job as plain JSON."""
    return {"plan": progress.plan.id, **_job(progress, job)}


def _job(progress: PlanProgress, job: CellJob) -> dict[str, object]:
    why, home = progress.why(job), progress.home_of(job.cell)
    return {
        "cell": job.cell,
        "home": None if home is None else home.home,
        "order": job.order,
        "ring": job.ring + 1,
        "state": str(job.state),
        "why": None if why is None else str(why),
        "attempt_count": job.attempt,
        "begun_at": job.begun_at or None,
        "ended_at": job.ended_at or None,
        "exit_code": job.code,
        "error": job.error or None,
        "reason": job.reason or None,
        "what": job.what or None,
        "change": job.change or None,
        "proof": job.proof or None,
    }


def show_progress(progress: PlanProgress) -> None:
    """Print how a plan stands: its rings, what waits and why, and what is left for a person."""
    plan = progress.plan
    say(f"{plan.id}  {plan.kind}: {plan.name}")
    rings = progress.rings()
    say_listed(
        {
            tr("ring {number}", number=number): _counted(counts)
            for number, counts in enumerate(rings, start=1)
        }
    )
    waits = progress.waits()
    for why in WaitReason:
        if waits[why]:
            say(tr("{count} waiting: {why}", count=waits[why], why=wait_in_words(why)))
    for home in progress.homes_left():
        say(f"  {_home(home)}")
    if plan.kind.moves:
        _show_cells(progress)
    for shown in halts_in_words(progress.standing):
        say(shown)
    if progress.standing and not progress.cancelled_at:
        say(tr("To go on: robolink fleet resume {plan} --reason WHY", plan=plan.id))
    left = [job for job in progress.jobs if job.state in _FOR_A_PERSON]
    left.sort(key=lambda job: _FOR_A_PERSON.index(job.state))
    for job in left[:_MOST_LISTED]:
        say(f"  {job.cell}: {state_in_words(job.state)}{_what(job)}")
    if left[_MOST_LISTED:]:
        say(tr("  and {more} more; --json lists all.", more=len(left) - _MOST_LISTED))


def _show_cells(progress: PlanProgress) -> None:
    """Print at which cells a person is waited for, and since when others are at work."""
    awaited = [job for job in progress.jobs if progress.why(job) is WaitReason.PERSON]
    running = [job for job in progress.jobs if job.state is JobState.RUNNING]
    for job in awaited[:_MOST_LISTED]:
        say(f"  robolink -c {job.cell} fleet next {progress.plan.id}")
    for job in running[:_MOST_LISTED]:
        say(tr("  {cell}: running since {when}", cell=job.cell, when=local_label(job.begun_at)))
    if more := len(awaited[_MOST_LISTED:]) + len(running[_MOST_LISTED:]):
        say(tr("  and {more} more; --json lists all.", more=more))


def show_job(progress: PlanProgress, job: CellJob) -> None:
    """Print one job, and why it waits."""
    why = progress.why(job)
    said = {
        tr("cell"): job.cell,
        tr("order"): job.order,
        tr("ring"): str(job.ring + 1),
        tr("state"): state_in_words(job.state),
    }
    if job.proof:
        said[tr("confirmed by")] = tr("turn test, entry {number}", number=job.proof)
    if why is not None:
        said[tr("waits for")] = wait_in_words(why)
    home = progress.home_of(job.cell)
    if home is not None:
        said[tr("home")] = _home(home)
    if job.begun_at:
        said[tr("attempt")] = f"{job.attempt}, {local_label(job.begun_at)}"
    if job.code is not None:
        said[tr("ended")] = tr("exit code {code}", code=job.code) + _what(job)
    say_listed(said)
    for halt in progress.standing:
        say(halt.sentence)


def _home(home: PlantHome) -> str:
    """Return a home, and when its agent was heard last."""
    if not home.heard_at:
        return tr("{home}: its agent was never heard", home=home.home)
    return tr(
        "{home}: its agent was heard last {when}", home=home.home, when=local_label(home.heard_at)
    )


def _what(job: CellJob) -> str:
    told = " ".join(filter(None, (job.error, f"({job.reason})" if job.reason else "", job.what)))
    return f": {told}" if told else ""


def states_payload(counts: Mapping[JobState, int]) -> dict[str, int]:
    """Return how many jobs are in each state, all states named, as plain JSON."""
    return {str(state): counts.get(state, 0) for state in JobState}


def _counted(counts: Mapping[JobState, int]) -> str:
    return ", ".join(f"{counts[state]} {state}" for state in JobState if counts.get(state))


def cells_payload(plant: str, cells: Mapping[str, CellState]) -> dict[str, object]:
    """Return how cells stand by their records as plain JSON."""
    return {"plant": plant, "cells": [state.as_json(name) for name, state in cells.items()]}


def show_cells(cells: Mapping[str, CellState]) -> None:
    """Print a line a cell: what is unfinished, its recipe, its last check."""
    if not cells:
        say(tr("Nothing was noted of any cell yet: an agent does that (robolink fleet agent)."))
        return
    columns = (tr("cell"), tr("recipe"), tr("since"), tr("last check"), tr("noted"), "")
    table(tr("Cells"), columns, [_cell_row(name, state) for name, state in cells.items()])


def _cell_row(name: str, state: CellState) -> tuple[str, ...]:
    recipe = state.recipe
    unfinished = ""
    if state.unsettled_since:
        unfinished = tr("unfinished since {when}", when=local_label(state.unsettled_since))
    return (
        name,
        f"{recipe.name} {recipe.hash[:_SHOWN_DIGITS]}" if recipe else "",
        local_label(recipe.since)[:10] if recipe else "",
        local_label(state.checked_at)[:16] if state.checked_at else "",
        local_label(state.noted_at)[:16],
        unfinished or (state.verdict if state.well is False else ""),
    )
