"""Which run of robolink a PLC's mailbox belongs to, by the token under which it was taken.

A PLC knows the owner of its mailbox by a token and nothing else. So each run that takes one
leaves a small file in the state folder, before it asks, and removes it when it has given the
mailbox back: after a kill the next run finds whose the token is. It need not outlive the power,
because after that the ten seconds of silence have passed.
"""

import json
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Final

from robolink import ambient
from robolink.files.durable import make_folder, state_folder
from robolink.journal._processes import LeaseHolder
from robolink.journal._sightings import describe
from robolink.model import ClientRun
from robolink.timing import wall_label

_SCHEMA: Final = "robolink/mailbox-client/1"
_KEPT_S: Final = 86_400.0
"""For so long a file of a run that has ended without removing it is kept at least."""


def note_client(client: str, holder: LeaseHolder) -> None:
    """Note, before it asks for a mailbox, whose a token is; a full state folder is no matter."""
    known = {"schema": _SCHEMA, "client": client, "holder": asdict(holder), "since": wall_label()}
    with suppress(OSError):
        path = _path(client)
        make_folder(path.parent)
        for old in _outdated(path.parent):
            old.unlink(missing_ok=True)
        draft = path.with_suffix(".new")
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with open(descriptor, "w", encoding="utf-8") as file:
            json.dump(known, file)
        os.replace(draft, path)


def forget_client(client: str) -> None:
    """Forget a token: the mailbox was given back, or was never got."""
    with suppress(OSError):
        _path(client).unlink(missing_ok=True)


def run_of(client: str, here: LeaseHolder) -> ClientRun | None:
    """Return the run whose token this is, ``None`` for one that was not noted here.

    Args:
        client: The token.
        here: This process, which judges whether the other still lives.
    """
    try:
        known = json.loads(_path(client).read_bytes())
        holder, since = LeaseHolder(**known["holder"]), str(known["since"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    if here.proves_gone(holder):
        return ClientRun(describe(holder), since, lives=False)
    # Of this process too: whether its earlier session still goes on is not known here.
    lives = True if here.can_tell(holder) and holder != here else None
    return ClientRun(describe(holder), since, lives=lives)


def _outdated(folder: Path) -> Iterator[Path]:
    for path in folder.iterdir():
        with suppress(OSError):
            if ambient.wall_s() - path.stat().st_mtime > _KEPT_S:
                yield path


def _path(client: str) -> Path:
    # Eight hexadecimal digits; anything else could name a file that is none of ours.
    name = client if client.isalnum() else "unreadable"
    return state_folder("clients") / f"{name}.json"
