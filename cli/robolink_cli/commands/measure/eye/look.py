"""eye look: one picture, everything that was found in it, and why something was refused."""

from pathlib import Path
from typing import Final

from robolink.files.named import require_free
from robolink.messages import tr
from robolink.timing import wall_time
from robolink_cli.commands.measure.eye.options import EyeOptions
from robolink_cli.commands.measure.eye.viewing import EyeView, viewing
from robolink_cli.console.exit_codes import DIFFERENT
from robolink_cli.console.render import emit, note, say
from robolink_cli.session.context import CliContext
from robolink_cli.views.eye import look_lines, look_payload, require_known_ending, save_look

MOST_LISTED: Final = 6
"""Candidates that are listed unless all are asked for; all accepted ones are in any case."""


def look_once(
    context: CliContext, which: EyeOptions, out: Path | None, *, force: bool, every: bool
) -> int:
    """Take a picture, show what is found, write it if wanted; return the exit code.

    Raises:
        CalibrationError: The camera delivers no picture; its code says why.
        ConfigError: It is not clear which camera, or the file cannot be written.
    """
    if out is not None:
        require_known_ending(out)
        require_free(out, replace=force)
    with viewing(context, which) as view:
        at, look = wall_time(), view.camera.glance()
    picture, candidates = look.picture, look.candidates
    accepted = sum(one.accepted for one in candidates)
    if out is not None:
        save_look(out, picture, candidates, title=view.title, at=at, overwrite=force)
    payload = look_payload(
        picture, candidates, camera=view.camera.identity, radius_px=view.shape.radius_px
    )
    payload |= {"station": view.station or None, "file": None if out is None else str(out)}

    def show() -> None:
        for line in look_lines(candidates, most=None if every else MOST_LISTED):
            say(line)

    emit("eye-look", payload, show)
    if view.shape.radius_px is None:
        note(radius_unknown(view))
    if out is not None:
        note(tr("Picture: {path}", path=out))
    return 0 if accepted == 1 else DIFFERENT


def radius_unknown(view: EyeView) -> str:
    """Return what is to be said where nobody knows how wide the tip is in the picture."""
    if view.camera.settings.diameter_mm is not None:
        return tr(
            "The length of a pixel is not known yet, so tips of every size are looked for: learn "
            "the station (robolink cell station learn), or give --diameter-px."
        )
    return tr(
        "The diameter of the tip is not known, so every size is looked for: state diameter_mm in "
        "the cell file, or give --diameter-px."
    )
