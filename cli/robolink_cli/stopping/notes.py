"""The note of a stop: shown before anything moves again, and removed by a person."""

from typing import TYPE_CHECKING

from robolink.errors import ConfigError, DeclinedError, RobolinkError, StoppedError
from robolink.messages import tr
from robolink.model import is_own_name
from robolink.stopping import StopNote, clear_note, find_note
from robolink.transport import far_end_of
from robolink_cli.console.person import person_here
from robolink_cli.console.render import note

if TYPE_CHECKING:
    from robolink.model import Controller
    from robolink_cli.stopping.request import StopRequest


def heed_stop(url: str, controller: "Controller", *, yes: bool) -> None:
    """Show who stopped this controller, before anything moves; ask, and remove the note.

    Args:
        url: How it was reached.
        controller: The controller, connected; it is asked who it is.
        yes: Whether the answer was given in advance.

    Raises:
        StoppedError: There is a note, and nobody is asked: ``--yes`` was given for a cell that
            nobody had stopped, or there is no terminal.
        DeclinedError: The answer was no.
    """
    from robolink_cli.prompts.questions import asked, not_yes

    keys, name = far_end_of(url), own_name_of(controller)
    found = find_note(keys, name)
    if found is None:
        return
    if yes or not person_here():
        raise StoppedError(
            found.sentence,
            remedy=tr("Look into the cell; then robolink robot release (or reset), or omit --yes."),
            controller=url.partition("?")[0],
        )
    note(found.sentence)
    if not asked(may_move_again()):
        raise DeclinedError(not_yes(), remedy=tr("Nothing was sent."))
    _clear(keys, name)


def forget_stop(url: str, name: str) -> None:
    """Remove the note after a reset at a person's request.

    Args:
        url: How the controller was reached.
        name: Its own name (:func:`own_name_of`).
    """
    _clear(far_end_of(url), name)


def own_name_of(controller: "Controller") -> str:
    """Return a controller's own name; empty if it has none, or nobody knows it."""
    try:
        name = controller.outcomes.identity
    except RobolinkError:
        return ""  # a broken journal, or a link whose loss the next exchange reports
    return name if is_own_name(name) else ""


def last_known(url: str) -> str:
    """Return who was last reached at the address of a URL, by the journal."""
    from robolink.journal import default_location, may_exist, open_journal
    from robolink.transport import parse_url

    try:
        address = parse_url(url).address
        if not may_exist(default_location(address)):
            return ""
        name = open_journal(address=address, read_only=True).log(address).identity
    except RobolinkError:
        return ""
    return name if is_own_name(name) else ""


def noted_stop(url: str) -> StopNote | None:
    """Return the note of a stop of the controller at a URL, shown; ``None`` where there is none."""
    found = find_note(far_end_of(url), last_known(url))
    if found is not None:
        note(found.sentence)
    return found


def may_move_again() -> str:
    """Return the question before anything moves again after a stop."""
    return tr("Has the cause been checked, and may the robot move again?")


def clear_noted_stop(url: str, agreed: StopNote) -> None:
    """Remove the note of a stop, because a person agreed when it was shown.

    Args:
        url: The controller.
        agreed: The note.

    Raises:
        StoppedError: The robot was stopped again meanwhile: nobody has agreed to that.
        ConfigError: It cannot be taken away.
    """
    keys, name = far_end_of(url), last_known(url)
    now = find_note(keys, name)
    if now is not None and now != agreed:
        raise StoppedError(
            now.sentence,
            remedy=tr("Look into the cell, then release the stop again."),
            controller=url.partition("?")[0],
        )
    _clear(keys, name)


def note_document(found: StopNote | None) -> dict[str, object] | None:
    """Return the note of a stop as plain JSON."""
    if found is None:
        return None
    return {
        "who": found.who,
        "when": found.when,
        "controller": found.url,
        "confirmed": found.confirmed,
    }


def url_of(request: "StopRequest") -> str:
    """Return the URL of a request.

    Raises:
        ConfigError: No controller is named, or no cell file has it.
    """
    from robolink_cli.access.cell import is_cell_name, nothing_named, only_cell, which_cell

    named = request.named
    if not named:
        named = only_cell()
        if not named:
            raise nothing_named()
        note(which_cell(named))
    if not is_cell_name(named):
        return named
    from robolink.config import reach_cell

    return reach_cell(named).url


def _clear(keys: frozenset[str], name: str) -> None:
    try:
        clear_note(keys, name)
    except OSError as error:
        raise ConfigError(
            tr(
                "The record of the stop could not be removed: {cause}.",
                cause=error.strerror or error,
            ),
            remedy=tr("Make the state folder writable for this user, then try again."),
        ) from error
