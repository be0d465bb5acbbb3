"""Permits inside a transaction: kept, revoked, and refused where they could permit nothing."""

from robolink.fleet.errors import PlanError
from robolink.fleet.progress import Permit
from robolink.fleet.store import statements
from robolink.fleet.store.rows import permit_values, plan_in, read_permit
from robolink.journal.store.chain import storable
from robolink.journal.store.connection import DatabaseConnection
from robolink.messages import known_names, tr


def add_permit(database: DatabaseConnection, permit: Permit, label: str) -> Permit:
    """Keep a permit under a number of its own.

    Args:
        database: The connection, within a transaction.
        permit: The permit.
        label: The time.

    Raises:
        PlanError: It is for a plant or a plan that nothing is known of, or ends before it begins.
    """
    _require_known(database, permit)
    values = permit_values(permit, label)
    while True:  # another may take the number meanwhile
        ((number,),) = database.rows(statements.NEXT_PERMIT)
        if database.run(statements.ADD_PERMIT, {"number": number, **values}):
            return read_permit(database.rows(statements.PERMIT, {"number": number})[0])


def revoke_permit(database: DatabaseConnection, number: int, by: str, label: str) -> Permit:
    """Revoke a permit; one that is revoked already stays so.

    Args:
        database: The connection, within a transaction.
        number: Its number.
        by: Who revokes it.
        label: The time.

    Raises:
        PlanError: There is none of that number.
    """
    values = {"number": number, "by_whom": storable(by), "at": label}
    database.run(statements.REVOKE_PERMIT, values)
    rows = database.rows(statements.PERMIT, {"number": number})
    if not rows:
        raise PlanError(
            tr("There is no permit {number}.", number=number), remedy=tr("Nothing was changed.")
        )
    return read_permit(rows[0])


def _require_known(database: DatabaseConnection, permit: Permit) -> None:
    plants = [name for (name,) in database.rows(statements.PLANTS)]
    if permit.plant not in plants:
        raise PlanError(
            tr("No plan of plant {plant} is known.", plant=permit.plant),
            remedy=known_names(plants, permit.plant) if plants else tr("Make a plan first."),
        )
    if permit.plan and plan_in(database, permit.plan).plan.plant != permit.plant:
        raise PlanError(
            tr("Plan {plan} is not of plant {plant}.", plan=permit.plan, plant=permit.plant),
            remedy=tr("Name the plant of the plan."),
        )
    if permit.until_at <= permit.from_at:
        raise PlanError(
            tr("The permit would end before it begins."),
            remedy=tr("Give a later end."),
        )
