"""Plans and outcomes for tests."""

from robolink.fleet import FleetStore, JobOutcome, Permit, Plan, TipCorrection, plan_of

OFFSET = {"tool": 1, "x_mm": 12.0}


def cells_of(count: int) -> list[str]:
    return [f"cell-{number:04d}" for number in range(1, count + 1)]


def plan_with(count: int = 6, kind: str = "offset", **keys: object) -> Plan:
    """Return a plan of as many cells; one that writes values by default."""
    cells = cells_of(count)
    table: dict[str, object] = {"schema": "robolink/fleet-plan/1", "kind": kind, "name": "test"}
    table["cells"] = cells
    if kind == "offset":
        table["offsets"] = dict.fromkeys(cells, OFFSET)
    return plan_of({**table, **keys}, cells=cells, author="Li", made_at="2026-11-30T22:00:00+00:00")


def permitted(store: FleetStore, plan: Plan) -> Plan:
    """Add a plan and a permit for it."""
    store.add_plan(plan)
    store.give_permit(
        Permit(
            0,
            plan.plant,
            "Chen",
            "engineer",
            "2026-11-30T00:00:00+00:00",
            "2026-12-31T00:00:00+00:00",
            given_by="Li",
        )
    )
    return plan


def usual(off_mm: float = 0.0, sigma_mm: float = 0.05) -> TipCorrection:
    """Return a correction of a cell with thirty earlier ones."""
    half = [sigma_mm if number % 2 else -sigma_mm for number in range(30)]
    return TipCorrection.of(1, "x", 12.0 + off_mm, [12.0 + one for one in half])


DONE = JobOutcome(0)


def carried_out(store: FleetStore, plan: Plan, cell: str, outcome: JobOutcome = DONE):
    """Begin a cell's job and record its end."""
    turn = store.begin(plan.id, cell)
    assert turn.begun, (cell, turn)
    return store.record_outcome(plan.id, cell, turn.job.attempt, outcome)
