"""Views made by hand: one of each screen and in each language, full enough to show what crowds."""

import json
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

from markupsafe import Markup
from robolink_cli.panel.cards import CellCard, ChangeRow, ChartCard, JobOffer
from robolink_cli.wizard.views.records import (
    Action,
    AngleRow,
    ArmPicture,
    Arrow,
    CheckRow,
    CheckView,
    ChoiceView,
    CoordinateRow,
    EndView,
    FitMark,
    FitView,
    Head,
    JogPad,
    ListRow,
    MovingView,
    QuestionView,
    Status,
    ToolValues,
    TouchView,
    ValueRow,
    ValuesView,
    View,
    WaitView,
    Weight,
)

WORDS = json.loads(Path(__file__).with_name("chinese.json").read_text(encoding="utf-8"))

MAIN, LEAVES = Weight.MAIN, Weight.LEAVES

_ARROWS = (
    Arrow("right", "x+", "X+"),
    Arrow("up", "y+", "Y+"),
    Arrow("left", "x-", "X-"),
    Arrow("down", "y-", "Y-"),
    Arrow("above", "z+", "Z+"),
    Arrow("below", "z-", "Z-"),
    Arrow("turn+", "u+", "U+"),
    Arrow("turn-", "u-", "U-"),
)


def pad(size=0.1, why_not=""):
    return JogPad((0.01, 0.1, 0.5, 1.0, 5.0), size, _ARROWS, why_not)


def views(language):
    """Return one view of each screen, by name."""
    made = _english()
    return {name: _chinese(view) for name, view in made.items()} if language == "zh" else made


def _view(head, body, actions, *, number=7, state="READY", halted=False, heard=(), message=""):
    status = Status(state, halted, 0.2, motors=True, low_power=True, tool=1)
    return View(number, True, head, status, body, tuple(actions), tuple(heard), message)


def _english():
    def head(title, step):
        return Head("line3", "Change needle", title, (step, 7), simulated=True, needle="N-0815")

    def act(name, label, weight=Weight.PLAIN, **more):
        return Action(name, label, weight=weight, **more)

    stop = act("leave", "End the job", LEAVES)
    late = "Last step 0.5 mm. Finish with a step of 0.10 mm or less."
    return {
        "choice": _view(
            head("Choose", 1),
            ChoiceView(
                ("Controller EPSON RC90-B, serial 0815; tool 1 is selected.",),
                "Which job?",
                (
                    ListRow("Needle 22G on the pin", "1", ("last done 26 Nov, Chen; about 4 min",)),
                    ListRow("One touch", "2", ("full calibration due in 3 changes; about 1 min",)),
                    ListRow("Two nozzles", "3", ("never done here",)),
                    ListRow("Find station PIN-07 again", "4", ("engineers only",)),
                ),
                0,
                "Open",
                "zh",
            ),
            [stop, act("language", "\u4e2d\u6587")],
        ),
        "check": _view(
            head("Check", 2),
            CheckView(
                (
                    CheckRow(
                        "ok", "OK", "Controller answers; emergency stop released, guard closed"
                    ),
                    CheckRow("ok", "OK", "All 15 tools are saved: backup of 28 Nov 14:23"),
                    CheckRow("look", "LOOK", "Tool 1 changed by 0.061 mm since the last report"),
                    CheckRow(
                        "you",
                        "YOU",
                        "The new needle is mounted and tight; tip and pin are clean",
                        "clean",
                        "Confirm",
                    ),
                    CheckRow(
                        "you",
                        "YOU",
                        "Nobody is in the cell, hoses are free",
                        "clear",
                        "Take it back",
                        confirmed=True,
                    ),
                    CheckRow("to do", "TO DO", "The motors are off", "motors", "Motors on"),
                ),
                "The robot will move by itself 9 times: power LOW, "
                "up to 20 mm/s, at most 60 mm from here.",
                2,
            ),
            [
                stop,
                act(
                    "start",
                    "Start moving (2 open)",
                    MAIN,
                    why_not="Confirm every row first: 2 are open.",
                ),
            ],
        ),
        "moving": _view(
            head("On the way", 3),
            MovingView(
                "Moving above the pin, 2 mm over the expected tip",
                "You bring the tip onto the pin.",
                ("To go: 118.4 mm", "Up to 20 mm/s, power LOW"),
                ArmPicture((240.0, 180.0), 40.0, (310.0, 290.0), (220.0, -20.0), follows=True),
                5.9,
            ),
            [stop],
            state="MOVING",
            number=0,
        ),
        "wait": _view(
            head("Please wait", 5),
            WaitView(("Touch 5 of 5 is taken.", "Lifting off the pin.")),
            [stop],
            number=0,
        ),
        "touch": _view(
            head("Touch 1 of 2", 4),
            TouchView(
                ("Jog the tip onto the pin.",),
                "Flange now",
                (
                    CoordinateRow("X", "153.184", "-5.416"),
                    CoordinateRow("Y", "501.218", "+5.818"),
                    CoordinateRow("Z", "-112.293", "-32.293"),
                    CoordinateRow("U", "40.00", "+0.00"),
                ),
                "33.27 mm, 41 steps",
                ("Height against touch 1: +0.012 mm", "Contact: no sensor, paper or magnifier"),
                (),
                pad(),
            ),
            [
                stop,
                act("again", "Touch 1 again"),
                act("take", "Record this touch", MAIN, why_not=late),
            ],
        ),
        "fit": _view(
            head("How well it fits", 5),
            FitView(
                (
                    FitMark(1, "U 0.0", (0.012, -0.015, 0.0), 0.024, "Y-", False),
                    FitMark(2, "U 72.0", (-0.02, 0.014, -0.003), 0.022, "X-", False),
                    FitMark(3, "U 144.0", (0.008, 0.019, 0.005), 0.021, "Y+", False),
                    FitMark(4, "U 216.0", (0.041, -0.061, 0.006), 0.075, "Y-", True),
                    FitMark(5, "U 288.0", (-0.006, 0.012, -0.007), 0.016, "Y+", False),
                ),
                0.05,
                (
                    "Repeatable to +-0.031 mm (95 %).",
                    "One more touch would make it about +-0.026 mm.",
                    "Touch 4 is 0.075 mm off, much more than the others.",
                ),
                0.027,
                0.031,
            ),
            [
                stop,
                act("go_on", "Show the result"),
                act("more", "One more touch"),
                act("again", "Touch 4 again", MAIN),
            ],
        ),
        "values": _view(
            head("New values", 6),
            ValuesView(
                (
                    ToolValues(
                        1,
                        (
                            ValueRow("X", "12.000", "12.327", "+0.327"),
                            ValueRow("Y", "-3.500", "-3.726", "-0.226"),
                            ValueRow("Z", "-20.000", "-20.000", "stays"),
                            ValueRow("U", "0.000", "0.000", "stays"),
                        ),
                        (
                            "The tip moves 0.398 mm.",
                            "X, Y: repeatable to +-0.024 mm, accurate to +-0.061 mm (95 %).",
                        ),
                        (
                            ("ok", "OK", "Change of the tip: 0.398 mm. Limit: 2.000 mm."),
                            ("look", "LOOK", "Z -20.000 is not measured; it stays."),
                        ),
                    ),
                ),
                (
                    "14 taught points use tool 1. Programs will run up to "
                    "0.398 mm differently there (most at P12). This corrects the present error.",
                ),
                "To write, type the tool number",
            ),
            [
                act("reject", "Do not write", LEAVES),
                act("again", "Touch 4 again", value="4"),
                act("more", "One more touch"),
                act("write", "Write", MAIN, field="tool"),
            ],
        ),
        "question": _view(
            head("Needle", 1),
            QuestionView(
                ("The needle is known by the id on its hub.",),
                "Scan or type the id of the new needle.",
                text=True,
            ),
            [stop, act("answer", "Next", MAIN, field="text")],
        ),
        "question-yes": _view(
            head("New values", 6),
            QuestionView(
                ("Z is not measured. Z stays -20.000.",),
                "Is the new needle exactly as long as the old one?",
                text=False,
            ),
            [act("leave", "End the job", LEAVES), act("no", "No"), act("yes", "Yes", MAIN)],
            heard=("The old needle was N-0790.",),
        ),
        "turn": _view(
            head("Turn test", 7),
            TouchView(
                (
                    "Jog the tip onto the pin again. robolink measures how far off it was.",
                    "Limit 0.200 mm. If it is off by more, robolink writes the old value back.",
                ),
                "Flange now",
                (
                    CoordinateRow("X", "165.684", "+0.016"),
                    CoordinateRow("Y", "482.918", "-0.011"),
                    CoordinateRow("Z", "-110.002", "-2.000"),
                    CoordinateRow("U", "120.00", "+0.00"),
                ),
                "2.00 mm, 6 steps",
                ("Contact: no sensor, paper or magnifier",),
                (AngleRow(0.0, 0.021, "OK", True), AngleRow(60.0, 0.028, "OK", True)),
                pad(0.01),
            ),
            [act("leave", "Stop: restore the old value", LEAVES), act("take", "Record", MAIN)],
            message="Recorded. Next angle: U 120.",
        ),
        "end": _view(
            head("DONE", 7),
            EndView(
                True,
                "DONE",
                (
                    "Needle N-0815 on tool 1 is measured, written and tested.",
                    "On the controller: tool 1 = X 12.327 Y -3.726 Z -20.000 U 0.000",
                    "X, Y: repeatable to +-0.024 mm, accurate to +-0.061 mm (95 %).",
                    "Run the first part slowly and watch it.",
                ),
                change="c-27",
                angles=(
                    AngleRow(0.0, 0.021, "OK", True),
                    AngleRow(120.0, 0.028, "OK", True),
                    AngleRow(240.0, 0.017, "OK", True),
                ),
                before_mm=0.398,
                after_mm=0.028,
                limit_mm=0.2,
            ),
            [act("report", "Report"), act("next", "Next tool"), act("finish", "Finish", MAIN)],
        ),
        "stopped": _view(
            head("STOPPED", 4),
            EndView(
                False,
                "STOPPED",
                (
                    "It ended here: Touch 2 of 2.",
                    "Somebody pressed STOP on the panel (Wang, tablet 2).",
                    "The robot has stopped (confirmed). Nothing was written; tool 1 is as it was.",
                    "Next: robolink recover",
                ),
                blocked=True,
            ),
            [act("leave", "Leave", LEAVES), act("begin_again", "Start again", MAIN)],
            state="STOPPED",
            halted=True,
        ),
    }


def _chinese(said):
    """Return the same in Chinese: every text of a record, looked up in ``chinese.json``."""
    if isinstance(said, Weight):
        return said
    if isinstance(said, str):
        return WORDS.get(said, said)
    if isinstance(said, tuple):
        return tuple(map(_chinese, said))
    if is_dataclass(said) and not isinstance(said, type):
        return replace(
            said, **{one.name: _chinese(getattr(said, one.name)) for one in fields(said)}
        )
    return said


JOBS = (
    JobOffer(
        "change",
        "Change needle",
        ("Needle 22G on the pin; last done 26 Nov, Chen; about 4 min",),
        {"recipe": "needle-22g"},
    ),
    JobOffer(
        "change",
        "One touch",
        ("full calibration due in 3 changes; about 1 min",),
        {"recipe": "one-touch"},
    ),
    JobOffer(
        "undo", "Undo the last change", ("change c-27 of 28 Nov 07:12",), why_not="Engineers only."
    ),
    JobOffer("check", "Check the cell", ("about 20 s, nothing moves",)),
)
CELLS = (
    CellCard(
        "line3",
        "ok",
        "READY",
        ("tool 1, needle N-0815", "changed 28 Nov 07:12, Chen"),
        simulated=True,
        jobs=JOBS,
    ),
    CellCard(
        "line4",
        "look",
        "MOVING",
        ("Change needle, touch 3 of 5",),
        simulated=True,
        busy=True,
        seat="Wang",
    ),
    CellCard(
        "line5", "bad", "EMERGENCY STOP", ("since 14:29:40", "nothing is sent"), simulated=True
    ),
    CellCard(
        "gantry",
        "unknown",
        "NO ANSWER",
        ("last heard 14:30:55", "old values are not shown"),
        simulated=True,
    ),
    CellCard("practice", "ok", "READY", ("tool 2", "nothing is unusual"), simulated=True),
)
CHANGES = tuple(
    ChangeRow(f"c-{n}", when, who, "tool 1, N-0815", agree, tested, moved, mark, word)
    for n, when, who, agree, tested, moved, mark, word in (
        (27, "26 Nov 07:12", "Chen", "0.021 mm", "0.031 mm", "0.061 mm", "look", "drifts"),
        (26, "24 Nov 13:40", "Wang", "0.018 mm", "0.024 mm", "0.049 mm", "ok", "passed"),
        (25, "22 Nov 07:05", "Chen", "0.044 mm", "0.212 mm", "0.000 mm", "bad", "rolled back"),
    )
)


def charts():
    """Return two control charts, drawn as the report draws them."""
    points = " ".join(f"{20 + 30 * n},{60 + (17 * n % 23) - n}" for n in range(18))
    svg = Markup(
        '<svg viewBox="0 0 640 120" role="img"><title>X of tool 1</title>'
        '<line class="allowed" x1="20" y1="20" x2="600" y2="20"/>'
        '<line class="allowed" x1="20" y1="95" x2="600" y2="95"/>'
        f'<polyline class="mean" points="{points}"/></svg>'
    )
    caption = "Dashed: limits of single values. Line: their weighted mean."
    return (
        ChartCard("X of tool 1", svg, caption, "drifts by 0.060 mm in 12 changes"),
        ChartCard("Y of tool 1", svg, caption),
    )
