"""The homes of a plant inside a transaction: when the agent of each was heard last."""

from collections.abc import Collection, Mapping
from datetime import datetime

from robolink.fleet.errors import PlanError
from robolink.fleet.plans import Plan
from robolink.fleet.progress import PlantHome
from robolink.fleet.store import statements
from robolink.journal import computer_key, this_process
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import tr


def hear_home(database: DatabaseConnection, plant: str, home: str, label: str) -> None:
    """Note that the agent of a home lives.

    Args:
        database: The connection, within a transaction.
        plant: Id of the plant.
        home: Name of this computer.
        label: The time.
    """
    here = this_process()
    values = {
        "plant": plant,
        "home": computer_key(home),
        "name": home,
        "at": label,
        "agent": f"{here.os_user}@{here.host} {here.pid}",
    }
    database.run(statements.HEAR_HOME, values)


def homes_in(database: DatabaseConnection, plant: str = "") -> tuple[PlantHome, ...]:
    """Return the homes whose agents were heard, of one plant or of all."""
    rows = (
        database.rows(statements.HOMES_OF, {"plant": plant})
        if plant
        else database.rows(statements.HOMES)
    )
    return tuple(PlantHome(*row) for row in rows)


def homes_of_plan(database: DatabaseConnection, plan: Plan, bound_to: str) -> dict[str, PlantHome]:
    """Return the homes of a plan's cells by their keys, also those that were never heard.

    Args:
        database: The connection, within a transaction.
        plan: The plan.
        bound_to: The computer that carries it out, where its cells name none.
    """
    names = dict.fromkeys(filter(None, (*plan.homes.values(), bound_to)))
    if not names:
        return {}
    heard = {computer_key(one.home): one for one in homes_in(database, plan.plant)}
    keys = {computer_key(name): name for name in names}
    return {key: heard.get(key, PlantHome(plan.plant, name)) for key, name in keys.items()}


def claimants(database: DatabaseConnection, plan: Plan) -> frozenset[str]:
    """Return the keys of the computers one of which carries out a plan whose cells name no home.

    Args:
        database: The connection, within a transaction.
        plan: The plan.

    Returns:
        Those whose agents were ever heard in its plant; empty where it may be any computer, and
        for a file, which only one has.
    """
    if not database.has_schemas:
        return frozenset()
    return frozenset(computer_key(one.home) for one in homes_in(database, plan.plant))


def require_all_cells(plan: Plan, cells: Collection[str]) -> None:
    """Refuse that a computer makes a plan its own whose cells it has not all.

    Args:
        plan: The plan.
        cells: Names of the computer's cells.

    Raises:
        PlanError: Some are missing.
    """
    missing = sorted({*plan.cells} - {*cells})
    if missing:
        raise PlanError(
            tr(
                "Plan {plan} waits for a computer that has all of its cells; this one has no "
                "{cells}.",
                plan=plan.id,
                cells=", ".join(missing[:3]),
            ),
            remedy=tr("Name the home of each cell in the cell files, then make the plan anew."),
        )


def cells_away(plan: Plan, homes: Mapping[str, PlantHome], now: datetime) -> frozenset[str]:
    """Return the cells of a plan at whose home no agent is heard, where one is needed.

    Args:
        plan: The plan. One that moves robots is carried out by people and programs at the cells.
        homes: Its homes, by their keys.
        now: The time, with its zone.
    """
    if plan.kind.moves:
        return frozenset()
    silent = {key for key, one in homes.items() if not one.is_heard(now)}
    return frozenset(cell for cell, home in plan.homes.items() if computer_key(home) in silent)


def require_one_computer(plan: Plan, home: str, name: str) -> None:
    """Refuse a plan whose cells have other homes than the computer of a file.

    Args:
        plan: The plan.
        home: Name of that computer.
        name: The file, as a person is told.

    Raises:
        PlanError: Some have.
    """
    others = {one for one in plan.homes.values() if computer_key(one) != computer_key(home)}
    if others:
        raise PlanError(
            tr(
                "Plan {plan} has cells at home on {homes}, and {name} is a file of this computer.",
                plan=plan.id,
                homes=", ".join(sorted(others)),
                name=name,
            ),
            remedy=tr(
                "Nothing was kept. Name a PostgreSQL database that all of them reach, in "
                "ROBOLINK_PLANT or with 'plant' in the cell file."
            ),
        )
