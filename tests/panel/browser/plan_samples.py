"""Plans and many cells, made by hand: what the pages of a plant show."""

from dataclasses import replace

from robolink_cli.panel.cards import CellCard, CellChoice, CellsBar, GroupCard
from robolink_cli.panel.plant.plan_cards import PlanChoice, plan_sight, plans_sight
from robolink_cli.panel.plant.plan_watch import PlantSight
from robolink_cli.panel.words import speak_several_languages, speaking_in

from robolink.fleet import (
    CellJob,
    Halt,
    HaltRule,
    JobState,
    Plan,
    PlanKind,
    PlanOverview,
    PlanProgress,
    Treatment,
    WaitFacts,
)

AT = "2026-11-30T09:12:00+00:00"
BIG = 2000


def many_cells(count=BIG):
    """Return the first page of many cells, and its bar."""
    cells = [
        CellCard(f"line{number // 40 + 1}-{number % 40:02}", "unknown", "not looked at")
        for number in range(48)
    ]
    cells[3] = replace(cells[3], mark="bad", word="emergency stop", lines=("In use: mei.",))
    cells[7] = replace(cells[7], mark="ok", word="ready", lines=("tool 1 selected",))
    signs = {"bad": 3, "look": 21, "busy": 4, "ok": 72, "unknown": count - 100}
    return cells, CellsBar(
        CellChoice(group="line3"), count, signs, count, -(-count // 48), grouped=True, plans=True
    )


def groups():
    """Return the page of groups."""
    signs = {"look": 2, "ok": 30, "unknown": 8}
    made = tuple(GroupCard(f"line{number}", 40, signs) for number in range(1, 13))
    made = (replace(made[0], signs={"bad": 1, **signs}), *made[1:])
    return CellsBar(CellChoice(groups=True), BIG, {}, BIG, 1, made, grouped=True, plans=True)


def progress(count=BIG):
    """Return a plan that stands in its third ring."""
    cells = [f"line{number // 40 + 1}-{number % 40:02}" for number in range(count)]
    rings = (tuple(cells[:1]), tuple(cells[1:5]), tuple(cells[5:]))
    plan = Plan(
        "6f1d0a9b3c27", PlanKind.OFFSET, "needles of November", "plant", rings, author="Li",
        made_at=AT,
    )  # fmt: skip
    jobs = []
    for number, cell in enumerate(cells):
        ring = 0 if number < 1 else 1 if number < 5 else 2
        job = CellJob(plan.id, cell, ring, JobState.WAITING)
        if number < 5:
            job = replace(job, state=JobState.UNPROVED, attempt=1, begun_at=AT, ended_at=AT, code=0)
        elif number == 5:
            job = replace(job, state=JobState.RUNNING, attempt=1, begun_at=AT)
        elif number in (6, 7):
            job = replace(
                job, state=JobState.REFUSED, attempt=1, begun_at=AT, ended_at=AT, code=5,
                error="NotReadyError", reason="guard_open",
                what="The controller is not ready: the guard is open.",
                treatment=Treatment.PERSON,
            )  # fmt: skip
        jobs.append(job)
    halts = (
        Halt(plan.id, 1, AT, HaltRule.PAUSE, numbers={"ring": 1, "cells": 1}, lifted_at=AT,
             lifted_by="Chen (panel)", reason="the first tip was looked at"),
        Halt(plan.id, 2, AT, HaltRule.REFUSALS, numbers={"refused": 2, "cells": 1995}),
        Halt(plan.id, 3, AT, HaltRule.PERSON, by="Wang, panel (mei@pc7)",
             numbers={"reason": "the line stands"}),
    )  # fmt: skip
    facts = WaitFacts(HaltRule.REFUSALS, 2, True, True, 1, 20)
    return PlanProgress(plan, tuple(jobs), halts, facts)


def sight(*, failed=False):
    """Return what was heard of the plant."""
    one = progress()
    overview = PlanOverview(one.plan, one.counts(), one.standing)
    done = replace(one.plan, id="0a1b2c3d4e5f", kind=PlanKind.CHECK, name="every night")
    posted = replace(one.plan, id="1a1b2c3d4e5f", kind=PlanKind.NOZZLE_CHANGE, name="A-17/3")
    plans = (
        overview,
        PlanOverview(posted, {JobState.WAITING: 1}),
        PlanOverview(done, {JobState.KEPT: 1996, JobState.MISSED: 4}),
        PlanOverview(replace(done, id="2a1b2c3d4e5f"), {JobState.CANCELLED: 2000}, (), AT),
    )
    lost = {"failed": "No answer came from the plant's database.", "failed_at": AT}
    return PlantSight(plans, {one.plan.id: one}, AT, **(lost if failed else {}))


def documents(pages, watcher):
    """Return whole pages by their paths."""
    speak_several_languages()  # as the panel does: states have words of the library
    cells, bar = many_cells()
    one = progress()
    choice = PlanChoice(one.plan.id)
    with speaking_in(watcher.language):
        listed, lost = plans_sight(sight()), plans_sight(sight(failed=True))
        shown = plan_sight(sight(), one, choice)
        left = plan_sight(sight(), one, PlanChoice(one.plan.id, "person"))
    return {
        "/many": pages.page("overview", watcher, parts=pages.overview(cells, watcher, bar)),
        "/groups": pages.page("overview", watcher, parts=pages.overview([], watcher, groups())),
        "/plans": pages.page("plans", watcher, parts=pages.of_plans("plans", listed, watcher)),
        "/plans-lost": pages.page("plans", watcher, parts=pages.of_plans("plans", lost, watcher)),
        "/plan": pages.page("plan", watcher, parts=pages.of_plans("plan", shown, watcher)),
        "/plan-left": pages.page("plan", watcher, parts=pages.of_plans("plan", left, watcher)),
        "/resume": pages.page("decision", watcher, sight=shown, resumes=True, onward="/plans"),
        "/halt": pages.page("decision", watcher, sight=shown, resumes=False, onward="/plans"),
    }


LONG = ("many", "groups", "plans", "plans-lost", "plan", "plan-left", "resume", "halt")
"""Pages that may be longer than a tablet: they are scrolled."""
