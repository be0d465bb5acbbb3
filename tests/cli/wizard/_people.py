"""States, subjects and a simulated hand for the tests of the wizard."""

import time
from dataclasses import replace
from math import cos, radians, sin

from robolink_cli.wizard.flow import advance
from robolink_cli.wizard.happenings import (
    KeyPressed,
    LineTyped,
    Reading,
    SendAnswer,
    WaitsForAnswer,
    WasAsked,
    WasRead,
    WasRegarded,
)
from robolink_cli.wizard.state import CheckPoint, CheckSubject, Header, Mark, WizardState

from robolink.calibration import (
    AccuracyFacts,
    Drift,
    DriftLimits,
    TurnJudgement,
    VerifyResult,
    assessed,
    solve_two_pose,
)
from robolink.calibration_run import (
    Attended,
    LimitVerdict,
    Proposal,
    Seating,
    WriteSubject,
    told_of_contradiction,
)
from robolink.calibration_run._turn_test import asked_what_follows
from robolink.messages import tr
from robolink.model import Pose, ToolOffset
from robolink.runner import FitRow, FitSubject, JogSubject, Question, TouchSubject

ARRIVAL = Pose(249.992, 200.004, -81.563, 90.0, tool=0)
HEADER = Header("line3", "Needle 22G", steps=7)


def touch_subject(**more):
    return TouchSubject(**{"number": 2, "total": 4, "arrival": ARRIVAL, **more})


def fit_subject(*off_mm, worst=None):
    rows = tuple(
        FitRow(
            number,
            tr(
                "Touch {number} at {where}",
                number=number,
                where=tr("U {u:.1f}", u=90.0 * (number - 1)),
            ),
            (off * cos(radians(90.0 * number)), off * sin(radians(90.0 * number))),
        )
        for number, off in enumerate(off_mm, start=1)
    )
    return FitSubject(rows, 0.066, repeatable_mm=0.074, next_mm=0.063, worst=worst, limit_mm=0.15)


def tilted_fit():
    """Twelve touches of a tilted tool; each is off along another axis."""
    rows = tuple(
        FitRow(
            number,
            tr(
                "Touch {number} at {where}",
                number=number,
                where=tr("U {u:.1f} V {v:.1f} W {w:.1f}", u=-15.0 * number, v=-10.5, w=-165.0),
            ),
            (0.001 * number, -0.002 * number, 0.04 - 0.013 * number),
        )
        for number in range(1, 13)
    )
    return FitSubject(rows, 0.066, repeatable_mm=0.074, next_mm=0.063, worst=11, more=True)


def write_subject(*tools):
    first, second = Pose(250.0, 200.0, -83.0, 0.0), Pose(274.6, 192.5, -83.0, 180.0)
    old = ToolOffset(11.998, -3.502, -20.0)
    result = assessed(solve_two_pose(first, second, stored=old, sigma_mm=0.02), AccuracyFacts())
    proposals = tuple(Proposal(tool, old, result, seating=Seating()) for tool in tools)
    verdict = LimitVerdict("implausible_change", tr("Change of the tip"), 0.391, 2.0)
    return WriteSubject(proposals, ((verdict,),) * len(tools))


def contradicted(**more):
    """Return the question of a turn test that contradicts its measurement, and its rows."""
    limits = DriftLimits(repeatable_mm=0.016, accurate_mm=0.087, turn_deg=180.0)
    judgement = TurnJudgement(
        "proof_contradicts_accuracy", (limits,), **{"wider_mm": 0.107, **more}
    )
    proof = VerifyResult((Drift(180.0, 0.1, 0.0),), 0.2, inputs=(ARRIVAL,), judgement=judgement)
    asked = []

    def choose(question, offered):
        asked.append((question, offered))
        return 0

    attended = Attended(choose, bool, lambda: proof, ("cell station learn BEAMS-02 --tool 15",))
    said = told_of_contradiction(proof, judgement)
    asked_what_follows(said, proof, judgement, attended, stated_mm=0.028, widest_mm=None)
    ((question, offered),) = asked
    return question, offered


CHECK = CheckSubject(
    (
        CheckPoint(Mark.OK, "Controller answers: T6-602S, serial T6S0012345"),
        CheckPoint(Mark.YOU, "New needle mounted and tight, pin PIN-07 clean", "mounted", "Yes"),
        CheckPoint(Mark.YOU, "Nobody in the cell, hoses free", "clear", "Yes"),
        CheckPoint(Mark.TO_DO, "Motors are off", "motors", "Switch them on"),
    ),
    "The robot will move by itself 6 times: power LOW, up to 20 mm/s, at most 150 mm from here.",
)


class Sitting:
    """A state and the input sent from it; the test advances the time."""

    def __init__(self, state=None, in_tool=0, *, motors=True):
        self.motors = motors
        self.here = replace(ARRIVAL, tool=in_tool)
        self.state = state or WizardState(HEADER)
        self.sent, self.now, self.number = [], 10.0, 0

    def happens(self, happening):
        self.state, effects = advance(self.state, happening)
        self.sent += [one.text if isinstance(one, SendAnswer) else one for one in effects]
        return self

    def asked(self, subject, kind=Question.PLACE, text="?"):
        self.number += 1
        if subject is not None:
            self.happens(WasRegarded(subject))
        self.happens(WasAsked(self.number, text, kind, self.now))
        self.reads(self.here)
        self.waits()
        self.now += 1.0
        return self.reads(self.here)

    def waits(self):
        return self.happens(WaitsForAnswer(self.number, self.now))

    def reads(self, pose):
        reading = Reading(self.now, "ready", pose=pose, motors=self.motors, low_power=True)
        return self.happens(WasRead(reading))

    def key(self, name, text=""):
        return self.happens(KeyPressed(name, text, self.now))

    def keys(self, *names):
        for name in names:
            self.key(name, name if len(name) == 1 else "")
        return self

    def line(self, text):
        return self.happens(LineTyped(text, self.now))

    def jogs(self, step):
        """Let the runner make the step that was sent last."""
        axis, by = step[0], float(step[1:])
        here = self.state.pose or ARRIVAL
        there = replace(here, **{f"{axis}_mm": getattr(here, f"{axis}_mm") + by})
        self.happens(WasRegarded(JogSubject(here, there, abs(by)))).waits()
        self.now += 1.0
        return self.reads(there)


def until(true, seconds=10.0):
    """Wait until a condition is true."""
    end_s = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end_s
        time.sleep(0.01)
