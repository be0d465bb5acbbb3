"""journal move: the journal, or the record of one controller, to another file or database."""

import os
from typing import TYPE_CHECKING, Annotated

import click

from robolink.messages import tr
from robolink.model import json_fields
from robolink_cli.commands.record.journal_lookup import (
    OfController,
    controller_meant,
    place_to_read,
)
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import emit, say, say_listed
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option, origin_of

if TYPE_CHECKING:
    from robolink.journal import JournalMove

_VARIABLE = "ROBOLINK_JOURNAL"


@click.command("move", short_help="Move the journal to another file or database.")
@json_option
def move(
    *,
    to: Annotated[str, CliArgument(metavar="FILE|URL")],
    controller: OfController = None,
    dry_run: Annotated[
        bool,
        CliOption(help="Show what would be moved and what is in the way; changes nothing."),
    ] = False,
) -> int:
    """Move the journal to another file or database, with every entry, number and hash.

    With -c only the record of that controller is moved, into a journal of its own with numbers of
    its own; the others stay. FILE or the database at URL must be missing or empty.

    Nobody may be working on a controller that is moved, and no job may be unfinished. The old
    journal can be read afterwards, and refuses to be written. If the command is interrupted, repeat
    it.
    """
    from robolink import __version__
    from robolink.journal import move_journal, plan_journal_move, signature_here

    # Whoever has named a cell for all commands has not said that its record leaves the journal.
    typed = controller is not None or origin_of("url") != "ROBOLINK_CONTROLLER"
    meant = controller_meant(controller) if typed else None
    source = place_to_read(meant)
    if dry_run:
        planned = plan_journal_move(to, controller=meant, source=source)
        emit("journal-move", _payload(planned, moved=False), lambda: _show_plan(planned))
        return DIFFERENT if planned.hindrances else 0
    here = signature_here(__version__)
    done = move_journal(to, controller=meant, source=source, signature=here)
    emit("journal-move", _payload(done, moved=True), lambda: _show_end(done))
    return 0


def _payload(found: "JournalMove", *, moved: bool) -> dict[str, object]:
    from robolink.config import lines_naming_journal

    return {
        **json_fields(found, "source", "target"),
        "controller": found.controller or None,
        **json_fields(found, "controllers", "entry_count", "last_number", "last_hash"),
        "hindrances": [f"{error.what} {error.remedy}" for error in found.hindrances],
        "named_in": [f"{path}:{number}" for path, number in lines_naming_journal(found.source)],
        "moved": moved,
    }


def _show_plan(found: "JournalMove") -> None:
    say(tr("entries that would be moved: {count}", count=found.entry_count))
    _show_way(found)
    for error in found.hindrances:
        say(f"{error.what} {error.remedy}")
    if not found.hindrances:
        say(tr("Nothing is in the way. Nothing was moved."))


def _show_end(found: "JournalMove") -> None:
    say(tr("entries moved: {count}", count=found.entry_count))
    _show_way(found)
    say(
        tr(
            "The last one there is {number}, {hash}.",
            number=found.last_number,
            hash=found.last_hash,
        )
    )
    say(tr("The old journal can still be read, and refuses to be written."))
    _show_what_to_set(found)


def _show_what_to_set(found: "JournalMove") -> None:
    from robolink.config import lines_naming_journal
    from robolink.journal import shown_location

    named = shown_location(os.environ.get(_VARIABLE, ""))
    if named:
        say(tr("{variable} still names the old one: {place}", variable=_VARIABLE, place=named))
    for path, number in lines_naming_journal(found.source):
        say(tr("{path}, line {number}, still names the old one.", path=path, number=number))
    say(
        tr(
            "Wherever this record is used, name it in {variable} or as journal in the cell file: "
            "{place}",
            variable=_VARIABLE,
            place=_place(found.target),
        )
    )


def _show_way(found: "JournalMove") -> None:
    say_listed(
        {
            tr("from"): _place(found.source),
            tr("to"): _place(found.target),
            tr("controllers"): ", ".join(found.controllers),
        }
    )


def _place(location: str) -> str:
    """Return a place as it is set in the environment: a file by its path."""
    return location.removeprefix("sqlite:///")
