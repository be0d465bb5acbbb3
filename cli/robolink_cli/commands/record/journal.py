"""journal list, show, checks, diff, drift, export, sync, verify, move: only move changes it."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal, NamedTuple

import click

from robolink.messages import declared, tr
from robolink.model import EntryKind, json_fields
from robolink_cli.commands.record.journal_checks import checks
from robolink_cli.commands.record.journal_drift import drift
from robolink_cli.commands.record.journal_lookup import (
    OfController,
    controller_meant,
    entries_named,
    entries_of_change,
    journal_to_read,
    place_to_read,
)
from robolink_cli.commands.record.journal_sync import PlantAnswer, asked_plant, sync
from robolink_cli.console.exit_codes import DIFFERENT, exit_code
from robolink_cli.console.render import emit, emit_json, json_is_on, say
from robolink_cli.lazy_group import LazyGroup
from robolink_cli.options.consent import Overwrite
from robolink_cli.options.declaration import CliArgument, CliOption
from robolink_cli.options.shared import json_option
from robolink_cli.session.completion import complete_tool

if TYPE_CHECKING:
    from robolink.journal import ChainVerification, Journal
    from robolink.model import Recorded

_KINDS: Final = {str(kind).replace(" ", "-"): kind for kind in EntryKind}


class _Wanted(NamedTuple):
    """The entries that the options select."""

    controller: OfController = None
    tool: Annotated[
        int | None, CliOption(shell_complete=complete_tool, help="Only entries about this tool.")
    ] = None
    kinds: Annotated[
        tuple[str, ...],
        click.Choice(list(_KINDS), case_sensitive=False),
        CliOption(
            "--kind",
            metavar="KIND",
            help="Only entries of this kind; a wrong name lists all kinds. May be repeated.",
        ),
    ] = ()
    change: Annotated[
        str | None, CliOption(metavar="ID", help="Only entries of this tool change.")
    ] = None

    def at_address(self) -> "_Wanted":
        """Return the same with the address of the controller, ``None`` for all."""
        return self._replace(controller=controller_meant(self.controller))

    def of(
        self, opened: "Journal", *, limit: int | None = None, newest_first: bool = True
    ) -> "Iterator[Recorded]":
        """Yield them, read page by page."""
        kinds = [_KINDS[kind] for kind in self.kinds]
        if self.change is None:
            return opened.entries(
                controller=self.controller,
                tool=self.tool,
                kinds=kinds,
                limit=limit,
                newest_first=newest_first,
            )
        found = [
            entry
            for entry in entries_of_change(opened, self.change, controller=self.controller)
            if self.tool in (None, entry.tool) and (not kinds or entry.kind in kinds)
        ]
        return iter((found[::-1] if newest_first else found)[:limit])


_BESIDES: Final = {
    "report": (
        "robolink_cli.commands.record.report:report",
        declared("Write one page about a tool change, from the journal, to keep or print."),
    ),
    "move": (
        "robolink_cli.commands.record.journal_move:move",
        declared("Move the journal to another file or database."),
    ),
}


@click.group(cls=LazyGroup, lazy=_BESIDES)
def journal() -> None:
    """Read the record about tools: values, tests, people. Its entries never change."""


journal.add_command(checks)
journal.add_command(drift)
journal.add_command(sync)


@journal.command("list")
@json_option
def list_entries(
    *,
    meant: _Wanted,
    limit: Annotated[int, click.IntRange(min=1), CliOption(help="Show at most this many.")] = 20,
) -> None:
    """Show the newest entries, newest first."""
    from robolink.journal import may_exist
    from robolink_cli.views.journal import entry_payload, show_list

    wanted = meant.at_address()
    location = place_to_read(wanted.controller)
    if not may_exist(location):
        if json_is_on():
            emit_json("robolink/journal/1", {"entries": []})
        else:
            say(tr("There is no journal yet at {location}.", location=location))
            say(tr("robolink creates it at the first change."))
        return
    entries = list(wanted.of(journal_to_read(wanted.controller), limit=limit))
    if json_is_on():
        emit_json("robolink/journal/1", {"entries": [entry_payload(entry) for entry in entries]})
    else:
        show_list(entries, all_controllers=wanted.controller is None)


@journal.command("show")
@json_option
def show(
    *,
    name: Annotated[str, CliArgument(metavar="NUMBER|CHANGE")],
) -> None:
    """Show all fields of one entry, or of all entries of a change."""
    from robolink_cli.views.journal import entry_payload, show_entry

    entries = entries_named(journal_to_read(), name)
    if json_is_on():
        payload = [entry_payload(entry) for entry in entries]
        emit_json("robolink/journal-entries/1", {"entries": payload})
        return
    for entry in entries:
        show_entry(entry)


@journal.command("diff", short_help="Show the differences between two entries or changes.")
@json_option
def diff(
    *,
    a: Annotated[str, CliArgument(metavar="NUMBER|CHANGE")],
    b: Annotated[str, CliArgument(metavar="NUMBER|CHANGE")],
) -> None:
    """Show the differences between two entries or changes: value, poses, tolerance, people."""
    from robolink_cli.views.journal import diff_payload, show_diff

    opened = journal_to_read()
    sides = entries_named(opened, a), entries_named(opened, b)
    emit("journal-diff", diff_payload(*sides), lambda: show_diff(*sides))


@journal.command("export", short_help="Write entries to a file, oldest first.")
@json_option
def export(
    *,
    file: Annotated[Path, CliArgument()],
    form: Annotated[
        Literal["csv", "json", "jsonl"] | None,
        CliOption("--format", help="Format of the file; default: by the ending of its name."),
    ] = None,
    force: Overwrite = False,
    since: Annotated[
        datetime | None,
        click.DateTime(["%Y-%m-%d"]),
        CliOption(metavar="YYYY-MM-DD", help="Only entries from this day on (UTC)."),
    ] = None,
    meant: _Wanted,
) -> None:
    """Write entries to FILE, oldest first; all of them, or those that you choose."""
    from robolink.files.named import require_free, save_named
    from robolink_cli.commands.record.journal_export import FORMATS, Counted, form_of

    written = form or form_of(file)
    require_free(file, replace=force)
    wanted = meant.at_address()
    begin = f"{since:%Y-%m-%d}" if since else ""
    entries = wanted.of(journal_to_read(wanted.controller), newest_first=False)
    counted = Counted(entry for entry in entries if entry.at >= begin)
    save_named(file, FORMATS[written](counted), replace=force)
    payload = {"file": str(file), "format": written, "entry_count": counted.count}
    if json_is_on():
        emit_json("robolink/journal-exported/1", payload)
    else:
        say(tr("{count} entries were written to {file}.", count=counted.count, file=file))


@journal.command("verify", short_help="Check that no entry was changed and none is missing.")
@json_option
def verify() -> int:
    """Check that no entry was changed and none is missing; exit code 1 otherwise.

    Checks of cells stand outside the chain; of those that are kept, each day is compared with its
    entry in the chain.

    The chain of hashes has no key. It shows changes of single entries by a disk, a program or a
    person. That somebody with access to the whole journal rebuilt all of it, or removed the newest
    entries and reset the note of the last one, shows only by a copy that this person cannot change:
    where the plant's database is named, this compares with it (exit code 3 if that does not
    answer). Otherwise keep the number and hash that this prints elsewhere, and compare.
    """
    opened = journal_to_read()
    with _progress(opened) as progress:
        found = opened.verify(progress)
    answer = asked_plant(opened)
    problems = (*found.problems, *(answer.problems if answer else ()))
    payload = {
        "entry_count": found.checked,
        "problems": list(problems),
        **json_fields(found, "last_number", "last_hash"),
        "keyed": False,
        "plant": answer.payload() if answer else None,
    }
    emit("journal-verified", payload, lambda: _show_verified(found, answer))
    if problems:
        return DIFFERENT
    return exit_code(answer.error) if answer and answer.error else 0


def _show_verified(found: "ChainVerification", answer: PlantAnswer | None) -> None:
    problems = (*found.problems, *(answer.problems if answer else ()))
    for problem in problems:
        say(problem)
    said = tr("problems: {count}", count=len(problems))
    whole = tr("nothing was changed and nothing is missing")
    end = said if problems else whole
    say(tr("{count} entries checked: {end}.", count=found.checked, end=end))
    if answer is not None:
        say(answer.sentence())
    if not found.last_number:
        return
    last = {"number": found.last_number, "hash": found.last_hash}
    if answer is not None and answer.witness is not None and answer.witness.number:
        say(tr("Last entry: {number}, {hash}.", **last))
    else:
        say(
            tr(
                "The last one is {number}, {hash}. Without a key this cannot detect a "
                "rebuilt journal: compare the hash with one kept elsewhere.",
                **last,
            )
        )


@contextmanager
def _progress(opened: "Journal") -> Iterator[Callable[[int, int], None] | None]:
    """Show the progress of a check, on a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(length=opened.count(), label=tr("checking"), file=sys.stderr) as bar:
        yield lambda done, _all: bar.update(done - bar.pos)
