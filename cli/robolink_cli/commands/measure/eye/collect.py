"""eye collect: a picture, and its truth marked by hand, for tests of the finder."""

import re
from collections.abc import Sequence
from dataclasses import asdict
from math import hypot, isfinite
from pathlib import Path
from typing import Final

from robolink import __version__
from robolink.errors import ConfigError, DeclinedError
from robolink.eye.candidate import Candidate
from robolink.eye.picture import CameraPicture
from robolink.eye.record.candidate_json import candidate_as_json
from robolink.eye.record.collection import MarkedTip, answer_to, save_collected
from robolink.eye.record.png import png_of
from robolink.files.named import save_named
from robolink.messages import tr
from robolink.sensing import sensor_name
from robolink.timing import wall_time
from robolink_cli.commands.measure.eye.options import EyeOptions
from robolink_cli.commands.measure.eye.viewing import viewing
from robolink_cli.console.person import person_here
from robolink_cli.console.render import emit, note, say
from robolink_cli.prompts.questions import asked_for_text
from robolink_cli.session.context import CliContext
from robolink_cli.views.eye import look_lines

_MOST_ASKED: Final = 5


def collect_one(
    context: CliContext,
    folder: Path,
    which: EyeOptions,
    truth: Sequence[str],
    *,
    no_tip: bool,
) -> None:
    """Take a picture, let a person mark it, and save both.

    Raises:
        CalibrationError: The camera delivers no picture.
        ConfigError: A mark makes no sense, or the folder cannot be written.
        DeclinedError: Nobody is there to mark it, or nothing was marked.
    """
    typed = tuple(map(marked, truth))
    if not typed and not no_tip and not person_here():
        raise DeclinedError(
            tr("The tip has to be marked by hand, and there is nobody to ask."),
            remedy=tr("Give --truth X,Y,R, or --no-tip where no whole tip is in the picture."),
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(
            tr("{folder} cannot be made: {cause}.", folder=folder, cause=error.strerror),
            remedy=tr("Name another folder."),
        ) from error
    with viewing(context, which) as view:
        at, look = wall_time(), view.camera.glance()
        picture, candidates = look.picture, look.candidates
        shape, camera = view.shape, sensor_name(view.camera.identity)
    require_inside(typed, picture)
    tips = typed if typed or no_tip else _asked(folder, picture)
    saved = save_collected(
        folder,
        picture.grey,
        tips,
        shape=shape,
        at=at,
        camera=camera,
        candidates=candidates,
        robolink_version=__version__,
        marked_by=context.operator or "",
    )
    answer = answer_to(tips, candidates)
    payload = {
        "file": str(saved.path),
        "tips": [asdict(one) for one in tips],
        "answer": answer.value,
        "off_px": [_off_px(one, candidates) for one in tips],
        "candidates": [candidate_as_json(one) for one in candidates],
    }

    def show() -> None:
        for line in look_lines(candidates):
            say(line)
        for tip, off_px in zip(tips, payload["off_px"], strict=True):
            if off_px is not None:
                say(
                    tr(
                        "Your mark at X {x:.1f} Y {y:.1f} px is {off:.2f} px from it.",
                        x=tip.x_px,
                        y=tip.y_px,
                        off=off_px,
                    )
                )
        say(tr("Saved: {path}", path=saved.path))

    emit("eye-collect", payload, show)


def marked(text: str) -> MarkedTip:
    """Return a mark as a person types it: X,Y,R in pixels.

    Raises:
        ConfigError: It is none.
    """
    parts = [part for part in re.split(r"[,;\s]+", text.strip()) if part]
    try:
        x, y, radius = map(float, parts)
    except ValueError:
        x = y = radius = float("nan")
    if not (isfinite(x) and isfinite(y) and isfinite(radius) and radius > 0):
        raise ConfigError(
            tr("{text!r} is no mark.", text=text),
            remedy=tr("Write X,Y,R in pixels, for example 641.5,512.0,24.5."),
        )
    return MarkedTip(x, y, radius)


def require_inside(tips: Sequence[MarkedTip], picture: CameraPicture) -> None:
    """Check that marks are in the picture.

    Raises:
        ConfigError: One is not wholly inside: such a tip counts as none.
    """
    width, height = picture.size_px
    for tip in tips:
        across = tip.radius_px - 0.5 <= tip.x_px <= width - 0.5 - tip.radius_px
        down = tip.radius_px - 0.5 <= tip.y_px <= height - 0.5 - tip.radius_px
        if not (across and down):
            raise ConfigError(
                tr(
                    "The mark {x:g},{y:g},{radius:g} is not wholly inside the picture of "
                    "{width} x {height} px.",
                    x=tip.x_px,
                    y=tip.y_px,
                    radius=tip.radius_px,
                    width=width,
                    height=height,
                ),
                remedy=tr("A tip that the picture cuts counts as none: --no-tip."),
            )


def _asked(folder: Path, picture: CameraPicture) -> tuple[MarkedTip, ...]:
    """Let a person mark the tips of a picture that they look at in a viewer of theirs."""
    shown = folder / "unmarked.png"
    save_named(shown, png_of(picture.grey), replace=True)
    note(
        tr(
            "Open {path} and mark the tip: middle and radius of the face's outer rim, in pixels. "
            "robolink shows afterwards what it found.",
            path=shown,
        )
    )
    question = tr("X,Y,R of the tip; several with a blank between; none for no whole tip.")
    try:
        for _ in range(_MOST_ASKED):
            text = asked_for_text(question)
            if text.lower() in ("none", tr("none")):
                return ()
            try:
                tips = tuple(map(marked, text.split()))
                require_inside(tips, picture)
            except ConfigError as error:
                note(str(error))
            else:
                return tips
    finally:
        shown.unlink(missing_ok=True)
    raise DeclinedError(tr("No answer was given."), remedy=tr("Nothing was saved."))


def _off_px(tip: MarkedTip, candidates: Sequence[Candidate]) -> float | None:
    """Return how far the nearest accepted candidate is from a mark."""
    accepted = [one for one in candidates if one.accepted]
    return min((hypot(one.x_px - tip.x_px, one.y_px - tip.y_px) for one in accepted), default=None)
