"""journal sync: copies the journal to the plant's database; and what verify asks there."""

from typing import TYPE_CHECKING, Annotated, Final, NamedTuple

import click

from robolink.errors import ConfigError, RobolinkError
from robolink.messages import tr
from robolink.model import json_fields
from robolink_cli.commands.record.journal_lookup import journal_to_read
from robolink_cli.console.render import emit, say, table
from robolink_cli.options.declaration import CliOption
from robolink_cli.options.shared import json_option

if TYPE_CHECKING:
    from robolink.journal import Journal, Witness

_SHOWN: Final = 12
"""Digits of a hash in a table."""


@click.command("sync", short_help="Copy the journal to the plant's database.")
@json_option
def sync(
    *,
    new_chain: Annotated[
        bool,
        CliOption(
            help="Copy this journal although another one was copied from this place before: a new "
            "record was begun on purpose. The copies of the other one stay."
        ),
    ] = False,
) -> None:
    """Copy the entries that the plant's database lacks, in order.

    ROBOLINK_PLANT names that database, or plant = "postgresql://..." at the top of a cell file.
    Each command that recorded something does the same at its end, and so does the panel. Exit code
    2 if the plant has other entries than this journal, 3 if its database does not answer.
    """
    from robolink.config import named_plant

    plant = named_plant()
    if plant is None or not plant.takes_copies:
        raise ConfigError(
            tr("No PostgreSQL database of a plant is named."),
            remedy=tr(
                'Set ROBOLINK_PLANT, or plant = "postgresql://user@host/database" at the top of a '
                "cell file."
            ),
        )
    journal = journal_to_read()
    journal.require_unmoved()
    with journal.outbox(plant.location) as outbox:
        found = outbox.copy(new_chain=new_chain)
    told = json_fields(found, "chain", "copied_count", "number", "hash", "behind_count")
    payload = {
        "plant": outbox.plant,
        "named_by": plant.origin,
        "journals": [{"journal": journal.location, **told}],
    }

    def show() -> None:
        say(tr("plant: {plant} ({origin})", plant=outbox.plant, origin=plant.origin))
        heads = [
            tr("journal"),
            tr("chain"),
            tr("copied now"),
            tr("last at the plant"),
            tr("behind"),
        ]
        row = [
            journal.location,
            found.chain[:_SHOWN] or "-",
            found.copied_count,
            found.number,
            found.behind_count,
        ]
        table(tr("copies"), heads, [row])

    emit("journal-synced", payload, show)


class PlantAnswer(NamedTuple):
    """What the plant's database answered about a journal.

    Attributes:
        plant: The database; what names it, where that names none.
        witness: What it says; ``None`` where it could not be asked.
        error: Why not.
    """

    plant: str
    witness: "Witness | None" = None
    error: RobolinkError | None = None

    @property
    def problems(self) -> tuple[str, ...]:
        """What differs, one sentence each."""
        return () if self.witness is None else self.witness.problems

    def payload(self) -> dict[str, object]:
        """Return it as plain JSON."""
        seen = self.witness
        return {
            "plant": self.plant,
            "number": None if seen is None else seen.number,
            "hash": None if seen is None else seen.hash,
            "error": None if self.error is None else self.error.what,
        }

    def sentence(self) -> str:
        """Return how far the plant confirms the journal, or why it could not be asked."""
        if self.error is not None:
            return str(self.error)
        if self.witness is None or not self.witness.number:
            return tr("The plant {plant} has no copy of this journal.", plant=self.plant)
        if self.problems:
            return tr("Compared with the plant {plant}.", plant=self.plant)
        return tr(
            "The plant {plant} has the same entries, up to {number}.",
            plant=self.plant,
            number=self.witness.number,
        )


def asked_plant(journal: "Journal") -> PlantAnswer | None:
    """Compare a journal with the plant's copy; ``None`` where no plant is named."""
    from robolink.config import named_plant

    plant = named_plant()
    if plant is None or not plant.takes_copies:
        return None
    name = plant.origin
    try:
        with journal.outbox(plant.location) as outbox:
            name = outbox.plant
            return PlantAnswer(name, outbox.witness())
    except RobolinkError as error:
        return PlantAnswer(name, error=error)
