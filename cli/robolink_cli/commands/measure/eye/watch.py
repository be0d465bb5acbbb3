"""eye look --watch: a line a picture, for focusing."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.candidate import Candidate
from robolink.eye.reasons import candidates_summary, reason
from robolink.messages import tr
from robolink_cli.commands.measure.eye.look import radius_unknown
from robolink_cli.commands.measure.eye.options import EyeOptions
from robolink_cli.commands.measure.eye.viewing import viewing
from robolink_cli.console.render import emit, json_is_on, note, say
from robolink_cli.session.context import CliContext

AT_MOST_HZ: Final = 5.0
"""Pictures a second: a person turns a ring, and a camera is not to be flooded."""

_SHARPER: Final = 0.08
"""Share by which an edge has to change to be told as sharper or blurrier; less is noise."""

_MOST_MISSED: Final = 5
"""Number of failures in a row after which the camera counts as gone."""


@dataclass(slots=True)
class Focus:
    """How sharp the tip was so far.

    Attributes:
        best_px: Narrowest edge.
        last_px: That of the last picture; ``None`` where no tip was found.
    """

    best_px: float | None = None
    last_px: float | None = None

    def compare(self, edge_px: float | None) -> str:
        """Take in the edge of a picture; return how it compares with the one before."""
        before, self.last_px = self.last_px, edge_px
        if edge_px is None:
            return ""
        first = self.best_px is None
        self.best_px = edge_px if self.best_px is None else min(self.best_px, edge_px)
        if first or before is None:
            return ""
        if edge_px < before * (1 - _SHARPER):
            return tr("sharper")
        if edge_px > before * (1 + _SHARPER):
            return tr("blurrier")
        return tr("the same")


def watch_on(context: CliContext, which: EyeOptions, count: int | None) -> int:
    """Take pictures until Ctrl-C, or ``count`` of them; a line for each. Returns the exit code.

    Raises:
        CalibrationError: The camera failed five times in a row.
        ConfigError: It is not clear which camera.
    """
    if which.picture is not None:
        raise ConfigError(
            tr("A picture file does not change."), remedy=tr("Leave out --watch, or name a camera.")
        )
    focus, taken, missed = Focus(), 0, 0
    with viewing(context, which) as view:
        if view.shape.radius_px is None:
            note(radius_unknown(view))
        if count is None:
            note(tr("Turn the focus ring until the edge is narrowest. Ctrl-C ends it."))
        try:
            while count is None or taken < count:
                begun_s = time.monotonic()
                try:
                    look = view.camera.glance()
                except CalibrationError as error:
                    missed += 1
                    if missed >= _MOST_MISSED:
                        raise
                    _show(error.what)
                else:
                    missed = 0
                    _show(watch_line(look.candidates, focus))
                taken += 1
                time.sleep(max(0.0, 1 / AT_MOST_HZ - (time.monotonic() - begun_s)))
        except KeyboardInterrupt:
            _show("")
    payload = {"pictures": taken, "narrowest_edge_px": focus.best_px, "edge_px": focus.last_px}
    emit("eye-watch", payload, lambda: _summarize(focus))
    return 0


def watch_line(candidates: Sequence[Candidate], focus: Focus) -> str:
    """Return the line about one picture.

    Args:
        candidates: What was found in it.
        focus: How sharp it was before; is brought up to date.
    """
    best = next((one for one in candidates if one.accepted), None)
    sharpness = focus.compare(best.edge_px if best is not None else None)
    if best is None:
        # The nearest miss: a tip that is out of focus is what focusing begins with.
        nearest = max(candidates, key=lambda one: one.score, default=None)
        if nearest is None:
            return candidates_summary(candidates)
        why = "; ".join(map(reason, nearest.refused))
        edge = "" if nearest.edge_px is None else tr("edge {edge:.1f} px", edge=nearest.edge_px)
        return tr("no tip: {edge} {why}", edge=edge, why=why)
    parts = [
        tr("edge {edge:.2f} px", edge=best.edge_px) if best.edge_px is not None else "",
        tr("radius {radius:.2f} px", radius=best.radius_px),
        tr("X {x:.2f} Y {y:.2f} px", x=best.x_px, y=best.y_px),
        sharpness,
        tr("narrowest so far {edge:.2f}", edge=focus.best_px) if focus.best_px else "",
    ]
    several = sum(one.accepted for one in candidates)
    if several > 1:
        parts.append(tr("{count} tips", count=several))
    return "  ".join(filter(None, parts))


def _show(line: str) -> None:
    say(line)
    if not json_is_on():
        import sys

        sys.stdout.flush()


def _summarize(focus: Focus) -> None:
    if focus.best_px is not None:
        say(tr("Narrowest edge: {edge:.2f} px.", edge=focus.best_px))
