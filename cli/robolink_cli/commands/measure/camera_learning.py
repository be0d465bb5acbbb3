"""station learn for a camera: a person confirms one picture, a known movement shows its lag.

What is learnt is how a tip looks in this camera and how late its pictures are. Where the camera
looks and what its pixels mean, ``calibrate camera-affine`` finds afterwards.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Final

from robolink.calibration_run import (
    Limits,
    PlannedStep,
    flange_now,
    foresee,
    require_inside,
)
from robolink.errors import (
    CalibrationError,
    ConfigError,
    DeclinedError,
    NotReadyError,
    RejectedError,
)
from robolink.eye.candidate import Candidate
from robolink.eye.eye_camera import EyeCamera, EyeLook
from robolink.eye.misses import miss
from robolink.eye.reasons import candidate_line
from robolink.eye.record.newest_look import note_newest
from robolink.eye.settings import EyeSettings
from robolink.eye.teaching import (
    LagSeen,
    MovedSpot,
    PictureLag,
    exposed_well,
    lag_after,
    nearest_to,
)
from robolink.messages import tr
from robolink.model import TIP, Controller, Pose
from robolink.model import Path as MovePath
from robolink.procedures import MeasurementContext
from robolink.runner import ArmAhead, ChoiceRow, Move, OfferedChoice, Procedure, Runner
from robolink.sensing import sensor_name
from robolink.stations import (
    Station,
    Taught,
    sensor_of,
    shape_stated,
    stations_on_record,
    teaching_entry,
)
from robolink.timing import SystemClock, wall_time
from robolink_cli.commands.measure.eye.viewing import eye_at, settings_of
from robolink_cli.console.person import Person, person_here
from robolink_cli.console.render import emit, note, say
from robolink_cli.prompts.operator import operator_at
from robolink_cli.session.connection import open_controller
from robolink_cli.session.context import CliContext
from robolink_cli.session.motion_consent import agree_to_motion, motion_question
from robolink_cli.views.eye import require_known_ending, save_look, zoomed
from robolink_cli.views.fit import show_plan, steps_payload
from robolink_cli.views.stations import station_payload

ASIDE_MM: Final = 1.0
"""How far the robot moves in X and in Y, in mm: as far as an approach begins beside its place."""

_MOST_OFFERED: Final = 8
_LOOKS: Final = 3
_MARGIN_S: Final = 0.05
_WIDE_EDGE_PX: Final = 4.0
"""Edge from which a tip may be out of focus, in pixels: those of drawings in focus are 1.2 to 2.7
wide (docs/reference/eye.md)."""


@dataclass(frozen=True, slots=True)
class LearnRequest:
    """What the command was told.

    Attributes:
        tool: The tool whose tip is before the camera.
        limits: How far and how fast the robot may move.
        picture: Where the picture is written; ``None`` for a name made from the station's.
        assist: A simulator's person in place of a real one.
        dry_run: Whether nothing is done.
        yes: Whether the question before a movement is answered; the picture's is never.
    """

    tool: int
    limits: Limits
    picture: Path | None
    assist: str | None
    dry_run: bool
    yes: bool


def learn_camera(context: CliContext, station: Station, request: LearnRequest) -> None:
    """Teach a camera what a tip looks like, and record it. Writes no tool.

    Raises:
        CalibrationError: The camera delivers no picture, nothing is found in it, or what was
            confirmed does not move with the robot.
        ConfigError: No camera is named, or it has a finder of its own.
        DeclinedError: A person did not confirm the picture, or nobody could be asked.
    """
    url = sensor_of(station)
    if not url:
        raise ConfigError(
            tr("It is not known which camera stands at {station}.", station=station.id),
            remedy=tr("State sensor in the cell file, for example http://HOST/PICTURE."),
        )
    if not request.dry_run and request.assist is None and not person_here():
        raise DeclinedError(
            tr("A person has to confirm the picture of the camera, and there is nobody to ask."),
            remedy=tr("Run it on a terminal or from the panel. --yes does not answer this."),
        )
    if request.picture is not None:
        require_known_ending(request.picture)
    job = "" if request.dry_run else tr("learn station {name}", name=station.id)
    there = context._replace(station=station.id)
    with open_controller(there, changes=not request.dry_run, job=job) as controller:
        if request.dry_run:
            _show_plan(controller, request)
            return
        with (
            eye_at(url, _untaught(station)) as camera,
            operator_at(request.assist, lambda: request.tool, controller.clock) as operator,
        ):
            bench = MeasurementContext(
                controller, operator, start=_here(controller), settings=request.limits.settings
            )
            runner = bench.runner(tool=request.tool)
            lesson = _Lesson(station, camera, runner, request)
            confirmed = lesson.confirm()
            lag = lesson.lag(controller, bench, confirmed)
        controller.outcomes.append(teaching_entry(lesson.taught(confirmed, lag)))
        kept = _now(context, controller, station)
    emit("station", station_payload(kept), lambda: _show(kept))


def _untaught(station: Station) -> EyeSettings:
    """Return what is stated of a camera, without what was taught before."""
    return replace(settings_of(station), bore_ratio=None, edge_px=None, lag_s=0.0, lag_pictures=0)


class _Lesson:
    """One teaching: the picture that a person confirms, then the known movement.

    Args:
        station: What is known of the camera's station.
        camera: The camera, untaught.
        runner: Asks the person.
        request: What the command was told.
    """

    def __init__(
        self, station: Station, camera: EyeCamera, runner: Runner, request: LearnRequest
    ) -> None:
        self._station, self._camera, self._runner = station, camera, runner
        self._request = request
        self._sensor = sensor_name(sensor_of(station))

    def confirm(self) -> Candidate:
        """Let a person confirm the tip in a picture; return it as the finder sees it then.

        Raises:
            CalibrationError: Nothing is found.
            DeclinedError: Nothing was confirmed.
        """
        if self._camera.settings.exposure_us is None:
            exposed_well(self._camera.source)
        look = self._camera.glance()
        offered = look.candidates[:_MOST_OFFERED]
        if not offered:
            raise self._nothing(look)
        self._show(look)
        chosen = self._chosen(look, offered)
        # From here on its radius is known, so that the finder measures edge and bore at it.
        shape = replace(self._camera.settings, radius_px=chosen.radius_px)
        self._camera = EyeCamera(self._camera.source, shape)
        return self._measured(chosen)

    def _show(self, look: EyeLook) -> None:
        """Put the picture where the person sees it: into a file, and onto the panel."""
        offered = look.candidates[:_MOST_OFFERED]
        refused = sum(not one.accepted for one in offered)
        for number, one in enumerate(offered, start=1):
            if one.accepted:
                note(candidate_line(number, one))
        if refused:
            note(tr("{count} other circles were refused; they are dashed.", count=refused))
        picture, near = zoomed(look.picture, offered) or (look.picture, offered)
        note_newest(self._sensor, picture, near, station=self._station.id)
        path = self._request.picture
        if path is None and person_here() is not Person.WIRE:
            path = Path(f"{_plain(self._station.id)}.html")
        if path is not None:
            save_look(
                path,
                look.picture,
                look.candidates[:_MOST_OFFERED],
                title=f"{self._station.id}: {self._sensor}",
                at=wall_time(),
                overwrite=True,
            )
            note(tr("The picture with its circles: {path}", path=path.absolute()))

    def _chosen(self, look: EyeLook, offered: Sequence[Candidate]) -> Candidate:
        accepted = [one for one in offered if one.accepted]
        if len(accepted) == 1:
            (only,) = accepted
            question = tr(
                "Look at the picture. Is circle 1 (radius {radius:.1f} px) exactly on the outer "
                "rim of the tip of tool {tool}, and is the tip sharp?",
                radius=only.radius_px,
                tool=self._request.tool,
            )
            if self._runner.confirm(question):
                return only
            if len(offered) == 1:
                raise _not_confirmed()
        if not accepted:
            note(self._nothing(look).what)
        rows = [ChoiceRow(tr("None of them: end"), tr("Nothing is recorded."))]
        rows += [
            ChoiceRow(tr("Circle {number}", number=number), candidate_line(number, one))
            for number, one in enumerate(offered, start=1)
        ]
        question = tr(
            "Look at the picture. Which circle is exactly on the outer rim of the tip of tool "
            "{tool}?",
            tool=self._request.tool,
        )
        chosen = self._runner.choose(question, OfferedChoice(self._station.id, tuple(rows)))
        if chosen == 0:
            raise _not_confirmed()
        return offered[chosen - 1]

    def _measured(self, chosen: Candidate) -> Candidate:
        """Return the median of the confirmed tip in three pictures.

        Raises:
            CalibrationError: The finder does not accept it again.
        """
        looks = self._camera.looks(TIP, _LOOKS)
        within_px = max(3.0, chosen.radius_px / 10)
        found = [
            one
            for look in looks
            if (one := nearest_to(chosen.x_px, chosen.y_px, look.candidates, within_px=within_px))
            is not None
        ]
        if len(found) < len(looks):
            raise self._nothing(looks[-1])
        return replace(
            found[0],
            x_px=median(one.x_px for one in found),
            y_px=median(one.y_px for one in found),
            radius_px=median(one.radius_px for one in found),
            edge_px=_median([one.edge_px for one in found]),
            bore_ratio=_median([one.bore_ratio for one in found]),
        )

    def _nothing(self, look: EyeLook) -> CalibrationError:
        said = miss(look.picture, look.candidates, self._camera.identity)
        return said or CalibrationError(
            "tip_not_seen",
            tr("Nothing in the picture is accepted as a tip."),
            remedy=tr(
                "'robolink eye look --out look.html' shows the picture and each reason. Check "
                "light, focus, and bore in the cell file."
            ),
        )

    def lag(
        self, controller: Controller, bench: MeasurementContext, confirmed: Candidate
    ) -> PictureLag | None:
        """Learn from a small movement how late pictures are; ``None`` where nothing may move.

        Raises:
            CalibrationError: What was confirmed does not move with the robot, or is not as wide
                as the cell file says; the robot is where it was before.
        """
        purpose = tr("to see how late the pictures of {station} are", station=self._station.id)
        try:
            _agree_to_move(controller, self._request, purpose)
        except (DeclinedError, NotReadyError, RejectedError) as error:
            note(error.what)
            note(_lag_unknown())
            return None
        with controller.preserved(purpose):
            controller.tools.select(0)
            here = controller.groups[0].pose()
            try:
                aside = self._moved(bench, _aside(here), confirmed)
            except CalibrationError:
                bench.run(_to(here))
                raise
            wait_s = aside.lag_s + _MARGIN_S if aside.pictures else 0.0
            back = self._moved(bench, here, aside.spot, wait_s=wait_s)
        seen = MovedSpot(confirmed, aside.spot, back.spot, math.hypot(ASIDE_MM, ASIDE_MM))
        seen.require_consistent(self._camera.settings.diameter_mm)
        if self._camera.settings.diameter_mm is None:
            note(
                tr(
                    "The confirmed circle is about {mm:.2f} mm wide. State diameter_mm in the "
                    "cell file.",
                    mm=seen.diameter_mm,
                )
            )
        return PictureLag.of(aside, back)

    def _moved(
        self, bench: MeasurementContext, target: Pose, before: Candidate, *, wait_s: float = 0.0
    ) -> LagSeen:
        clock = SystemClock()
        bench.run(_to(target))
        stopped_ns = clock.now_ns()
        clock.sleep(wait_s)
        return lag_after(
            lambda: self._camera.glance().candidates, before, clock=clock, stopped_ns=stopped_ns
        )

    def taught(self, confirmed: Candidate, lag: PictureLag | None) -> Taught:
        """Return what is recorded."""
        settings = self._camera.settings
        if confirmed.edge_px is not None and confirmed.edge_px > _WIDE_EDGE_PX:
            note(
                tr(
                    "The edge of the tip is {edge:.1f} px wide; in focus it is usually below "
                    "{limit:.1f}. 'robolink eye look --watch' helps to focus; then learn again.",
                    edge=confirmed.edge_px,
                    limit=_WIDE_EDGE_PX,
                )
            )
        return Taught(
            station=self._station.id,
            tool=self._request.tool,
            radius_px=round(confirmed.radius_px, 3),
            edge_px=None if confirmed.edge_px is None else round(confirmed.edge_px, 3),
            bore_ratio=None if confirmed.bore_ratio is None else round(confirmed.bore_ratio, 4),
            exposure_us=settings.exposure_us or self._camera.source.exposure_us,
            lag_s=None if lag is None else lag.seconds,
            lag_pictures=None if lag is None else lag.pictures,
            shape=shape_stated(self._station.details),
            sensor=self._sensor,
        )


def _show(station: Station) -> None:
    """Show what was recorded."""
    details = station.details
    say(tr("Recorded for station {id}:", id=station.id))
    units = {"radius_px": "px", "edge_px": "px", "bore_ratio": "", "exposure_us": "us"}
    for key, unit in units.items():
        if key in details:
            say(f"  {key} = {details[key]} {unit}".rstrip())
    if "lag_s" in details:
        late = details["lag_s"] or details.get("lag_pictures")
        say(
            tr(
                "  its pictures are late: by {seconds:.3f} s and {pictures} pictures",
                seconds=details["lag_s"],
                pictures=details.get("lag_pictures", 0),
            )
            if late
            else tr("  its pictures are not late")
        )
    if "mm_per_px" not in details:
        say(
            tr(
                "Next: robolink calibrate camera-affine --station {id} finds what its pixels mean.",
                id=station.id,
            )
        )


def _agree_to_move(controller: Controller, request: LearnRequest, purpose: str) -> None:
    """Ask before the small movement.

    Raises:
        DeclinedError: The answer was no, or nobody could be asked.
        LimitError: It does not fit into the limits.
        NotReadyError: Nothing can move now.
        RejectedError: robolink does not move robots of this kind.
    """
    require_inside(controller, _foreseen(controller, request))
    question = motion_question(
        controller, purpose, speed_mm_s=request.limits.speed_mm_s, box_mm=2 * ASIDE_MM
    )
    agree_to_motion(question, yes=request.yes)


def _here(controller: Controller) -> Pose | None:
    """Return where the flange is, ``None`` where this kind of controller does not tell it."""
    try:
        return flange_now(controller)
    except RejectedError:
        return None


def _foreseen(controller: Controller, request: LearnRequest) -> tuple[PlannedStep, ...]:
    here = flange_now(controller)

    def course() -> Procedure[None]:
        yield from _to(_aside(here))
        yield from _to(here)

    settings, ahead = request.limits.settings(here, None), ArmAhead.of(controller)
    return foresee(course(), here=here, settings=settings, arm=ahead)


def _show_plan(controller: Controller, request: LearnRequest) -> None:
    steps = () if _here(controller) is None else _foreseen(controller, request)
    payload = {
        "dry_run": True,
        "tool": request.tool,
        "steps": steps_payload(controller, steps) if steps else [],
    }
    emit("dry-run", payload, lambda: show_plan(payload))


def _aside(here: Pose) -> Pose:
    return replace(here, x_mm=here.x_mm + ASIDE_MM, y_mm=here.y_mm + ASIDE_MM)


def _to(target: Pose) -> Procedure[None]:
    yield Move(target, MovePath.STRAIGHT, tr("Moving 1 mm in X and Y, to see it in the picture."))


def _not_confirmed() -> DeclinedError:
    return DeclinedError(
        tr("The picture was not confirmed."),
        remedy=tr("Nothing was recorded. Correct light, focus or place of the tip; learn again."),
    )


def _lag_unknown() -> str:
    return tr(
        "Without a movement it stays unknown how late the pictures of this camera are. Looks are "
        "still checked by movements; learn again when the robot may move."
    )


def _median(values: Sequence[float | None]) -> float | None:
    known = [one for one in values if one is not None]
    return median(known) if known else None


def _plain(name: str) -> str:
    """Return a name as a file may be called."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "camera"


def _now(context: CliContext, controller: Controller, station: Station) -> Station:
    return stations_on_record(controller, context.cell).get(station.id, station)
