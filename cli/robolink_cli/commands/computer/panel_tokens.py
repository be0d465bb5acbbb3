"""panel token give, list, revoke: which line computer may order what, and until when."""

import datetime
from typing import TYPE_CHECKING, Annotated, Final

import click

from robolink.errors import ConfigError
from robolink.messages import known_names, tr
from robolink.model import json_fields
from robolink.timing import local_label, wall_label, wall_time
from robolink_cli.commands.fleet.plant import Operator, who
from robolink_cli.console.render import emit, say, table
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import LINE, json_option

if TYPE_CHECKING:
    from robolink_cli.panel.guard.line_tokens import LineToken

_FORMS: Final = ["%Y-%m-%d", "%Y-%m-%dT%H:%M"]


@click.group()
def token() -> None:
    """Tokens of line computers, which order jobs by POST /jobs (docs/panel.md)."""


@token.command("give", short_help="Make a token for a line computer, and show it once.")
@json_option
def give(
    *,
    name: Annotated[str, LINE, CliArgument()],
    kind: Annotated[
        tuple[str, ...],
        CliOption(metavar="KIND", help="A kind of job that it may order. May be repeated."),
    ],
    cell: Annotated[
        tuple[str, ...],
        CliOption(metavar="CELL", help="A cell, a pattern or an @group. May be repeated."),
    ],
    until: Annotated[
        datetime.datetime,
        click.DateTime(_FORMS),
        CliOption(metavar="TIME", help="When it ends: 2026-12-01 or 2026-12-01T05:00, local time."),
    ],
    plant: Annotated[str, LINE, CliOption(metavar="NAME", help="The plant.")] = "plant",
    permit: Annotated[
        str | None,
        LINE,
        CliOption(metavar="GROUP", help="Its jobs wait for this group of permits, and no other."),
    ] = None,
    replace: Annotated[
        bool, CliOption(help="Replace the token of this name; it ends at once.")
    ] = False,
    operator: Operator = None,
) -> None:
    """Let the line computer NAME order jobs from this computer's panel.

    The token is shown once; here only its hash is kept. A job that moves a robot waits for a yes at
    its cell all the same, and one that changes something for a permit.
    """
    from robolink.config import load_cell_files, names_meant
    from robolink_cli.panel.guard.line_tokens import LineToken, LineTokens

    _require_kinds(kind)
    files = load_cell_files()
    names_meant(cell, tuple(files.cells), files.groups)  # what names nobody is a mistake
    ends = until.astimezone()
    if ends <= wall_time():
        raise ConfigError(tr("The token would have ended already."), remedy=tr("Give a later end."))
    label = ends.astimezone(datetime.UTC).isoformat(timespec="seconds")
    by, at = who(operator), wall_label()
    made = LineToken(name, kind, cell, label, plant, by, at, permit or "")
    secret = LineTokens().give(made, replace=replace)
    payload = {**_payload(made), "token": secret.reveal()}

    def show() -> None:
        say(secret.reveal())
        say(tr("This is the token of {name}. It is not shown again.", name=name))

    emit("panel-token", payload, show)


@token.command("list")
@json_option
def list_tokens() -> None:
    """Show the tokens of this computer, never their secrets."""
    from robolink_cli.panel.guard.line_tokens import LineTokens

    tokens = LineTokens().all()

    def show() -> None:
        if not tokens:
            say(tr("There are no tokens here."))
            return
        rows = [
            (
                one.name,
                " ".join(one.kinds),
                " ".join(one.cells),
                one.permit,
                tr("ended") if one.ended() else local_label(one.until),
                one.by,
            )
            for one in tokens
        ]
        columns = (
            *(tr("name"), tr("kinds"), tr("cells"), tr("permit group")),
            *(tr("until"), tr("given by")),
        )
        table(tr("Tokens of line computers"), columns, rows)

    emit("panel-tokens", {"tokens": [_payload(one) for one in tokens]}, show)


@token.command("revoke", short_help="End a token now.")
@json_option
def revoke(*, name: Annotated[str, LINE, CliArgument()]) -> None:
    """End the token of NAME now, also on a panel that runs. What it ordered stays ordered."""
    from robolink_cli.panel.guard.line_tokens import LineTokens

    LineTokens().revoke(name)
    payload = {"name": name, "revoked": True}
    emit(
        "panel-token-revoked", payload, lambda: say(tr("The token of {name} has ended.", name=name))
    )


def _require_kinds(kinds: tuple[str, ...]) -> None:
    from robolink.fleet import PlanKind

    for kind in kinds:
        if kind not in list(PlanKind):
            raise ConfigError(
                tr("There is no kind of job {kind!r}.", kind=kind),
                remedy=known_names(list(map(str, PlanKind)), kind),
            )


def _payload(one: "LineToken") -> dict[str, object]:
    return {
        **json_fields(one, "name", "until", "plant", "by", "at"),
        "permit": one.permit or None,
        "kinds": list(one.kinds),
        "cells": list(one.cells),
    }
