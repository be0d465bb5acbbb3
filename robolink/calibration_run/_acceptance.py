"""Acceptance limits of a measurement, and the verdict in words."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from robolink.calibration import (
    ACCURACY_ROWS,
    CalibrationResult,
    DriftVerdict,
    VerifyResult,
    beyond_tolerance,
    order_in_words,
    require_shrinking,
    writes_refused_unattended,
)
from robolink.calibration_run._proposal import LimitVerdict, Proposal
from robolink.errors import CalibrationError, VerifyError
from robolink.messages import joined, tr
from robolink.model import ChangeLimits
from robolink.stations import StationKind


@dataclass(frozen=True, slots=True)
class AcceptanceCriteria:
    """Limits of a measurement; a limit of ``None`` is not checked.

    Attributes:
        max_change_mm: Largest plausible change against the stored value, over the lengths measured.
        rms_mm: Largest root mean square of the residuals.
        max_residual_mm: Largest residual.
        interval_mm: Largest distance from the truth within which the tip lies in 95 %, all measured
            lengths together and every row of the budget counted.
        drift_tolerance_mm: Largest drift that passes the verification.
        accepted_change_mm: A larger change that an engineer accepts this time.
        stated: Names of the limits that were stated for this measurement, not for all of a cell; of
            a limit that cannot be judged these are refused. That of the interval always is.
        accepted_with: The option that sets it, for whoever is refused; empty where there is none.
        unattended: Nobody is asked before the write, so that a doubt which a person could weigh is
            a refusal.
    """

    max_change_mm: float = 2.0
    rms_mm: float | None = None
    max_residual_mm: float | None = None
    interval_mm: float | None = None
    drift_tolerance_mm: float = 0.2
    accepted_change_mm: float | None = None
    accepted_with: str = ""
    unattended: bool = False
    stated: frozenset[str] = frozenset()

    @property
    def limit_mm(self) -> float:
        """The largest change that is believed this time."""
        return max(self.max_change_mm, self.accepted_change_mm or 0.0)

    def within(self, limits: ChangeLimits) -> "AcceptanceCriteria":
        """Return these limits, with no larger change than a cell allows without an engineer."""
        if limits.length_mm is None or limits.length_mm >= self.max_change_mm:
            return self
        return replace(self, max_change_mm=limits.length_mm)

    def judge_fit(self, result: CalibrationResult) -> None:
        """Refuse a measurement whose parts disagree.

        Raises:
            CalibrationError: ``large_rms``, ``large_residual``, ``large_interval``, or
                ``not_judged`` where nothing tells what a limit is for; the first two for poses that
                nobody saw being taken even where no limit is stated; where nobody is asked,
                ``step_in_run_order``, ``drift_in_run_order`` or ``sigma_contradicted``.
        """
        doubt = writes_refused_unattended(result) if self.unattended else ""
        if doubt:
            raise CalibrationError(
                doubt,
                _out_of_order(result) or tr("The touches agree far less well than stated."),
                remedy=tr(
                    "Nothing was written: no person confirms this write. Measure again, or let a "
                    "person check it."
                ),
            )
        self._require_judged(result)
        self._refuse_unwatched(result)
        by_defaults = self.over_by_defaults(result) is not None
        for verdict in self._of_fit(result):
            if by_defaults and verdict.code == "large_interval":
                continue  # a person may accept it; the writer asks
            if not verdict.passed:
                raise CalibrationError(
                    verdict.code,
                    tr(
                        "{name}: {found:.3f} mm, limit {limit:.3f} mm.",
                        name=verdict.name,
                        found=verdict.found_mm,
                        limit=verdict.limit_mm,
                    ),
                    remedy=tr(
                        "Clean pin and tip, check that the nozzle is tight, then measure again."
                    ),
                )

    def _require_judged(self, result: CalibrationResult) -> None:
        """Refuse a limit that the measurement cannot be checked against.

        Raises:
            CalibrationError: ``not_judged``.
        """
        for name, limit_mm, found_mm, what in (
            ("rms_mm", self.rms_mm, result.rms_mm, tr("how well the touches agree")),
            (
                "max_residual_mm",
                self.max_residual_mm,
                result.max_residual_mm,
                tr("which touch fits worst"),
            ),
            ("interval_mm", self.interval_mm, result.accurate_to_mm, tr("its accuracy")),
        ):
            asked = name == "interval_mm" or name in self.stated
            if limit_mm is not None and found_mm is None and asked:
                raise CalibrationError(
                    "not_judged",
                    tr(
                        "The limit of {limit:g} mm cannot be judged: {method} does not "
                        "report {what}.",
                        limit=limit_mm,
                        method=result.method,
                        what=what,
                    ),
                    remedy=tr(
                        "Nothing was written. Leave out the limit, or use a method that reports it."
                    ),
                )

    def over_by_defaults(
        self,
        result: CalibrationResult,
        *,
        station: str = "",
        kind: StationKind | None = None,
        tool: int | None = None,
    ) -> CalibrationError | None:
        """Return why a statement exceeds the limit only because of default rows.

        The error names the largest of them and what measures it. ``None`` where the statement is
        within the limit, or over it without them.

        Args:
            result: The measurement, with what it is accurate to.
            station: Where it was made; empty where no name is known.
            kind: What that is.
            tool: The tool.

        Example:
            >>> from robolink.calibration import AccuracyFacts, assessed, solve_two_pose
            >>> from robolink.model import Pose
            >>> from robolink.calibration_run import AcceptanceCriteria
            >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
            >>> found = assessed(solve_two_pose(*touches, sigma_mm=0.02), AccuracyFacts())
            >>> refusal = AcceptanceCriteria(interval_mm=0.05).over_by_defaults(found, tool=1)
            >>> refusal.code, "cell accuracy measure touch_mm --tool 1" in refusal.remedy
            ('large_interval', True)
        """
        accuracy, limit_mm = result.accuracy, self.interval_mm
        if accuracy is None or limit_mm is None or accuracy.within_mm <= limit_mm:
            return None
        row = accuracy.largest_default
        if row is None or accuracy.without_defaults_mm > limit_mm:
            return None
        return CalibrationError(
            "large_interval",
            tr(
                "Accurate to +-{found:.3f} mm (95 %), limit {limit:.3f} mm, due to a default.",
                found=accuracy.within_mm,
                limit=limit_mm,
            ),
            remedy=joined(
                " ",
                (
                    tr("Nothing was written."),
                    _how_measured(row.key, station=station, kind=kind, tool=tool),
                ),
            ),
        )

    def _refuse_unwatched(self, result: CalibrationResult) -> None:
        """Refuse poses that nobody watched and that disagree, as 'solve' does.

        What a stated limit judges is left to it. Touches that were watched are proved by a turn
        test instead.
        """
        if "touches_not_witnessed" not in result.notes:
            return
        stated = {"large_rms": self.rms_mm, "large_residual": self.max_residual_mm}
        judged = [code for code, limit_mm in stated.items() if limit_mm is not None]
        codes = beyond_tolerance(result.warnings, judged=judged)
        if codes:
            raise CalibrationError(
                codes[0],
                _worst_in_words(result),
                remedy=tr("Nothing was written. Record that pose again, or all of them."),
                others=codes[1:],
            )

    def judge_change(
        self, proposal: Proposal, *, earlier_mm: Sequence[float] = (), remedy: str = ""
    ) -> None:
        """Refuse a change that no nozzle change explains.

        Args:
            proposal: What is to be written.
            earlier_mm: Lengths in the plane of the corrections made since this nozzle was mounted,
                oldest first.
            remedy: What else to do about an implausible change, one line.

        Raises:
            CalibrationError: ``diverging`` or ``implausible_change``.

        Example:
            >>> from robolink.calibration import solve_two_pose
            >>> from robolink.errors import CalibrationError
            >>> from robolink.model import Pose, ToolOffset
            >>> from robolink.calibration_run import AcceptanceCriteria, Proposal
            >>> stored = ToolOffset(9, -4, -20)
            >>> touches = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
            >>> result = solve_two_pose(*touches, stored=stored)
            >>> try:
            ...     AcceptanceCriteria(max_change_mm=2).judge_change(Proposal(1, stored, result))
            ... except CalibrationError as error:
            ...     print(error.code)
            implausible_change
        """
        change, in_plane = proposal.change_mm, proposal.plane_change_mm
        if change is None or in_plane is None:
            return
        # Z often comes from another method, so only the changes in the plane are compared.
        require_shrinking(in_plane, earlier_mm)
        if change > self.limit_mm:
            raise CalibrationError(
                "implausible_change",
                tr(
                    "The tip would move {change:.3f} mm; {limit:.3f} mm is allowed.",
                    change=change,
                    limit=self.limit_mm,
                ),
                remedy=joined(
                    " ",
                    filter(
                        None,
                        (tr("Is the right nozzle mounted, and tight?"), remedy, self._way_past),
                    ),
                ),
            )

    def verdicts(self, proposal: Proposal) -> tuple[LimitVerdict, ...]:
        """Return what each limit says; nothing about what is not checked or not known."""
        fit = self._of_fit(proposal.result)
        if proposal.change_mm is None:
            return tuple(fit)
        change = LimitVerdict(
            "implausible_change", tr("Change of the tip"), proposal.change_mm, self.limit_mm
        )
        return (*fit, change)

    def jumps(self, proposal: Proposal) -> bool:
        """Return whether the change is larger than a nozzle change explains."""
        change = proposal.change_mm
        return change is not None and change > self.max_change_mm

    @property
    def _way_past(self) -> str:
        if not self.accepted_with:
            return ""
        return tr("Allow a real change with {option}.", option=self.accepted_with)

    @property
    def tolerance(self) -> str:
        """The limits in words."""
        return joined("; ", self._in_words())

    def _in_words(self) -> Iterator[str]:
        yield tr("change up to {limit:g} mm", limit=self.max_change_mm)
        if self.rms_mm is not None:
            yield tr("rms up to {limit:g} mm", limit=self.rms_mm)
        if self.max_residual_mm is not None:
            yield tr("residual up to {limit:g} mm", limit=self.max_residual_mm)
        if self.interval_mm is not None:
            yield tr("accurate to +-{limit:g} mm or better (95 %)", limit=self.interval_mm)

    def _of_fit(self, result: CalibrationResult) -> Iterator[LimitVerdict]:
        for code, name, found_mm, limit_mm in (
            ("large_rms", tr("How well the touches agree"), result.rms_mm, self.rms_mm),
            (
                "large_residual",
                tr("The touch that fits worst"),
                result.max_residual_mm,
                self.max_residual_mm,
            ),
            (
                "large_interval",
                tr("Accurate to (95 %)"),
                result.accurate_to_mm,
                self.interval_mm,
            ),
        ):
            if found_mm is not None and limit_mm is not None:
                yield LimitVerdict(code, name, found_mm, limit_mm)


def _how_measured(key: str, *, station: str, kind: StationKind | None, tool: int | None) -> str:
    """Return how to measure a default row, one sentence."""
    if key not in ACCURACY_ROWS:
        return tr("State the scatter of one touch, or make six touches or more.")
    from robolink.accuracy import measuring_step  # imported only when used

    return measuring_step(key, station=station, kind=kind, tool=tool)


def _worst_in_words(result: CalibrationResult) -> str:
    """Return which pose fits worst, and by how much."""
    distances = result.residual_distances_mm
    worst = max(range(len(distances)), key=distances.__getitem__)
    return tr(
        "The poses do not agree: pose {number} is {distance:.3f} mm off.",
        number=worst + 1,
        distance=distances[worst],
    )


def _out_of_order(result: CalibrationResult) -> str:
    """Return what moved while the touches were made; empty if nothing did."""
    order = result.evidence.run_order if result.evidence is not None else None
    return order_in_words(order) if order is not None else ""


def require_proved(result: VerifyResult, identity: str) -> None:
    """Refuse a turn test that did not pass.

    Args:
        result: What it showed.
        identity: Of the controller.

    Raises:
        VerifyError: The tip drifts, may drift, or its touches do not agree in height.
    """
    if result.passed:
        return
    if result.codes:
        raise VerifyError(
            tr(
                "The heights of the turn test differ from those of the measurement: "
                "at least one touch was in the air."
            ),
            remedy=tr("Measure again. Each time, jog until the tip is on the pin."),
            code=result.codes[0],
            controller=identity,
        )
    drift_mm, limit_mm = result.max_drift_mm, result.tolerance_mm
    if result.verdict is DriftVerdict.UNDECIDED:
        what = tr(
            "Turn test not decided: {drift:.3f} mm off, too near the limit of {limit:.3f} "
            "mm, even after more touches.",
            drift=drift_mm,
            limit=limit_mm,
        )
    else:
        what = tr(
            "Turn test failed: {drift:.3f} mm off, limit {limit:.3f} mm.",
            drift=drift_mm,
            limit=limit_mm,
        )
    raise VerifyError(
        what,
        remedy=tr("Clean pin and tip, check that the nozzle is tight, then measure again."),
        code=result.verdict.value,
        controller=identity,
    )
