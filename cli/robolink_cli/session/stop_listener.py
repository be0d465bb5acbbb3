"""Lets a second terminal stop the controller of a command, and leaves its address."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from robolink.errors import RobolinkError
from robolink.messages import tr
from robolink.model import says_it_is_simulated
from robolink_cli.console.render import note
from robolink_cli.prompts.current_desk import current_desk

if TYPE_CHECKING:
    from robolink.model import Controller, ControllerStatus
    from robolink_cli.session.context import CliContext


@contextmanager
def listening_for_stop(
    controller: "Controller", context: "CliContext", *, looks: bool
) -> Iterator[None]:
    """Listen for the ``stop`` of another terminal while the block has the controller.

    A simulator inside this process is nobody else's to stop. A command that looks or calms is
    found by its address alone: it does not wait for the journal, which knows the name.
    """
    from robolink.stopping import StopListener, no_place_to_listen

    url = context.require_url()
    if "+sim://" in url:
        yield
        return
    name = ""
    if not looks:
        # A broken journal or a lost link is reported by the next code that needs it.
        with suppress(RobolinkError):
            name = controller.outcomes.identity
    try:
        listener = StopListener(
            controller,
            url,
            who=_who(context),
            name=name,
            heard=_say_who,
            seen=None if looks else lambda: _last_seen(controller),
        )
    except OSError as error:
        note(no_place_to_listen(error))
        yield
        return
    with listener:
        yield


def _last_seen(controller: "Controller") -> "tuple[ControllerStatus, int] | None":
    found = controller.ledger.seen
    return None if found is None else (found[0], controller.clock.now_ns() - found[1])


def remember_address(context: "CliContext", proof: str | None = None) -> None:
    """Store how the cell was reached, for a stop when its file cannot be read.

    Args:
        context: What the command was told.
        proof: Of the cell files, where it is known already.
    """
    if context.cell is None or "+sim://" in context.cell.url:
        return
    from robolink.config import Reach, proof_of_files, remember_reach

    settings = context.cell.settings
    remember_reach(
        context.cell.name,
        context.cell.origins["url"],
        Reach(
            context.cell.url,
            password_file=settings.password_file or "",
            password_env=settings.password_env or "",
            timeout_s=settings.timeout_s or 0.0,
            journal=settings.journal or "",
            home=settings.home or "",
            proof=proof_of_files() if proof is None else proof,
            expected=context.cell.expected,
        ),
    )


def _who(context: "CliContext") -> str:
    import getpass
    import os

    try:
        user = getpass.getuser()
    except (OSError, KeyError, ImportError):
        user = "?"
    command = click.get_current_context().command_path
    return tr(
        "{who} ('{command}', process {pid})",
        who=context.operator or user,
        command=command,
        pid=os.getpid(),
    )


def _say_who(who: str) -> None:
    note(tr("Stopped from another terminal by {who}.", who=who))


def seen_by_another(url: str) -> dict[str, object] | None:
    """Return the document of what the controller's holder last read.

    ``None`` where nobody on this computer has it, where its holder lets nobody look, and where
    the controller serves several clients. The controller is not asked: it serves one client, and
    that one is at work.

    Args:
        url: The controller.
    """
    from robolink.transport import far_end_of, serves_several

    if serves_several(url) or "+sim://" in url:
        return None
    from robolink.stopping import HolderGoneError, holders_of

    try:
        holders = list(holders_of(far_end_of(url)))
    except RobolinkError:
        return None  # connecting reports what is wrong with the URL
    for holder in holders:
        try:
            seen = holder.last_seen()
        except HolderGoneError:
            continue
        flags = {} if seen is None else asdict(seen.status)
        return {
            "controller": url.partition("?")[0],
            "held_by": holder.who or tr("process {pid}", pid=holder.pid),
            "pid": holder.pid,
            "age_s": None if seen is None else round(seen.age_s, 3),
            "state": None if seen is None else str(seen.status.state),
            **flags,
        }
    return None


@contextmanager
def watched_at_desk(controller: "Controller") -> Iterator[None]:
    """Let the desk of a wizard read ``controller`` while a person is asked, for the block."""
    desk = current_desk()
    if desk is None:
        yield
        return
    from robolink_cli.wizard.glance import ControllerGlance
    from robolink_cli.wizard.happenings import CellIs

    if says_it_is_simulated(controller):
        desk.regard(CellIs(simulated=True))
    glance = ControllerGlance(controller)
    before, desk.glance = desk.glance, glance.at_rest
    try:
        with desk.following(glance.on_the_way):
            yield
    finally:
        desk.glance = before
