"""fleet permit give, list, revoke: who lets plans change something, and until when."""

import datetime
from typing import TYPE_CHECKING, Annotated, Final, Literal

import click

from robolink.messages import tr
from robolink_cli.commands.fleet.plant import Operator, open_plant, who
from robolink_cli.console.render import emit, say, table
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import LINE, json_option
from robolink_cli.views.fleet import permit_payload

if TYPE_CHECKING:
    from robolink.fleet import Permit

_FORMS: Final = ["%Y-%m-%d", "%Y-%m-%dT%H:%M"]
_TIME: Final = click.DateTime(_FORMS)


@click.group()
def permit() -> None:
    """Permits for plans that change something at their cells."""


@permit.command("give", short_help="Give a permit to a person.")
@json_option
def give(
    *,
    person: Annotated[str, LINE, CliArgument()],
    until: Annotated[
        datetime.datetime,
        _TIME,
        CliOption(metavar="TIME", help="When it ends: 2026-12-01 or 2026-12-01T05:00, local time."),
    ],
    begin: Annotated[
        datetime.datetime | None,
        _TIME,
        CliOption("--from", metavar="TIME", help="When it begins; now unless given."),
    ] = None,
    role: Annotated[Literal["operator", "engineer"], CliOption(help="The person's role.")] = (
        "engineer"
    ),
    plant: Annotated[str, LINE, CliOption(metavar="NAME", help="The plant.")] = "plant",
    group: Annotated[
        str | None,
        LINE,
        CliOption(
            metavar="NAME",
            help="Only plans and orders that wait for this group of permits; all unless given.",
        ),
    ] = None,
    plan: Annotated[str | None, LINE, CliOption(metavar="PLAN", help="Only this plan.")] = None,
    operator: Operator = None,
) -> None:
    """Let plans of a plant change something, with PERSON answering for it.

    A person at the cell is asked all the same before a robot moves.
    """
    from robolink.fleet import Permit
    from robolink.timing import wall_time

    begins = begin.astimezone() if begin else wall_time()
    wanted = Permit(
        0,
        plant,
        person,
        role,
        _label(begins),
        _label(until.astimezone()),
        group or "",
        plan or "",
        given_by=who(operator),
    )
    with open_plant() as store:
        given = store.give_permit(wanted)
    emit("fleet-permit", permit_payload(given), lambda: _show([given]))


@permit.command("list")
@json_option
def list_permits() -> None:
    """Show all permits, those that were revoked too."""
    with open_plant() as store:
        permits = store.permits()
    payload = {"permits": [permit_payload(one) for one in permits]}
    emit("fleet-permits", payload, lambda: _show(permits))


@permit.command("revoke", short_help="Revoke a permit.")
@json_option
def revoke(
    *,
    number: Annotated[int, click.IntRange(min=1), CliArgument()],
    operator: Operator = None,
) -> None:
    """Revoke permit NUMBER: no job begins by it any more. What runs comes to its end."""
    with open_plant() as store:
        revoked = store.revoke_permit(number, who(operator))
    emit("fleet-permit", permit_payload(revoked), lambda: _show([revoked]))


def _label(time: datetime.datetime) -> str:
    return time.astimezone(datetime.UTC).isoformat(timespec="seconds")


def _show(permits: "list[Permit] | tuple[Permit, ...]") -> None:
    from robolink.timing import local_label

    if not permits:
        say(tr("No permit was given yet."))
        return
    columns = (tr("permit"), tr("plant"), tr("for"), tr("person"), tr("from"), tr("until"), "")
    rows = [
        (
            one.number,
            one.plant,
            one.plan or one.group or tr("all plans"),
            f"{one.person} ({one.role})",
            local_label(one.from_at),
            local_label(one.until_at),
            tr("revoked by {who}", who=one.revoked_by) if one.revoked_by else "",
        )
        for one in permits
    ]
    table(tr("Permits"), columns, rows)
