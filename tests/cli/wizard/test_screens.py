"""Screens are compared with stored text, in two languages and one that is 40 % longer."""

import unicodedata
from dataclasses import replace
from pathlib import Path

import pytest
from robolink_cli.wizard.ending import ended_of
from robolink_cli.wizard.happenings import (
    HasEnded,
    Reading,
    TaughtPoints,
    WasRead,
    WasRegarded,
    WasTold,
    WizardCommand,
)
from robolink_cli.wizard.screens.layout import broken, key_rows
from robolink_cli.wizard.screens.screen import screen_of
from robolink_cli.wizard.screens.sentences import told_before, told_question
from robolink_cli.wizard.state import (
    CheckPoint,
    CheckSubject,
    ChoiceSubject,
    Header,
    Mark,
    WizardState,
)
from wcwidth import wcswidth

from robolink import messages
from robolink.calibration import (
    AccuracyFacts,
    Drift,
    DriftLimits,
    TurnJudgement,
    VerifyResult,
    held_to_claim,
    impact_on,
    turn_claim,
)
from robolink.calibration_run import ChangeReport, ToolReport
from robolink.controller_outcome import ControllerOutcome, note_outcome
from robolink.errors import (
    CalibrationError,
    ConfigError,
    ControllerFaultError,
    DeclinedError,
    OutcomeUnknownError,
    VerifyError,
)
from robolink.locale.languages import CHINESE, ENGLISH
from robolink.messages import spoken, tr
from robolink.methods import find_method
from robolink.model import Path as Way
from robolink.model import Pose, ToolOffset, ToolReceipt, WorkBox
from robolink.runner import AngleShown, JogRange, MoveSubject, Question
from tests._commands import chinese
from tests.cli.wizard._people import (
    ARRIVAL,
    CHECK,
    Sitting,
    contradicted,
    fit_subject,
    tilted_fit,
    touch_subject,
    write_subject,
)

STORED = Path(__file__).with_name("screens")
LANGUAGES = ("en", "zh", "pseudo")
SCARA = (70.0, -40.0, 0.0, 0.0)
"""Joint angles for the pose below, with links of 325 and 275 mm."""


def moving():
    here = Pose(349.3, 442.9, -60.0, 43.2, tool=0)
    seen = Reading(10.0, "ready", pose=here, axes=SCARA, motors=True, low_power=True)
    hand = Sitting().happens(WasRead(seen))
    going = MoveSubject(
        Pose(300.0, 400.0, -60.0, 90.0, tool=0),
        Way.JOINT,
        20.0,
        tr("Turning in the air."),
        tr("Lowering beside the pin."),
    )
    return hand.happens(WasRegarded(going))


def touching():
    hand = Sitting().asked(touch_subject(first_z_mm=-83.577))
    hand.keys("+", "+", "3")
    hand.jogs("z-1.0").keys("5")
    return hand


def length_seen():
    """The screen of touch 2 shows the result of touch 1."""
    said = tr(
        "The needle seems {mm} mm longer than the old one (touch 1 alone: +-{half} mm, if the pin "
        "is where it was).",
        mm="0.51",
        half="0.14",
    )
    return Sitting().happens(WasTold(said)).asked(touch_subject(retakes=True, types=True))


TILTED = Pose(-249.992, -200.004, 181.563, -90.0, -10.5, -165.0, tool=0)


def touching_tilted(**more):
    """A touch of an arm with six axes."""
    hand = Sitting()
    hand.here = TILTED
    subject = touch_subject(arrival=replace(TILTED, z_mm=183.563, v_deg=-10.0), types=True, **more)
    return hand.asked(subject)


def turning_tilted():
    """The turn test of such an arm, with the largest possible content above the keys."""
    earlier = tuple(AngleShown(-150.0 + 60.0 * n, 0.018, True) for n in range(5))
    return touching_tilted(number=6, total=None, limit_mm=0.1, earlier=earlier)


def writing_tilted():
    """New values of a tool with a measured tilt."""
    subject = write_subject(1)
    (proposal,) = subject.proposals
    old = ToolOffset(-111.998, -103.502, 220.0, -90.0, -179.9, -165.0)
    result = replace(proposal.result, offset=replace(old, x_mm=-112.3, v_deg=179.9))
    proposals = (replace(proposal, before=old, result=result),)
    return Sitting().asked(replace(subject, proposals=proposals), Question.YES_NO)


def moving_for_long():
    """The present and the next steps need more room than the picture leaves."""
    hand = moving()
    going = replace(
        hand.state.subject,
        purpose="Turning in the air to U -90.0 V -10.5 W -165.0, tilted away from the pin.",
        then="Lowering beside the pin until the tip is 2 mm above where it is expected to touch.",
    )
    return hand.happens(WasRegarded(going))


def turning_on():
    """The third place of a turn test: one angle passed, one is touched again."""
    earlier = (AngleShown(90.0, 0.008, True), AngleShown(180.0, 0.093, None))
    subject = touch_subject(
        number=3,
        total=None,
        limit_mm=0.1,
        earlier=earlier,
        arrival=replace(ARRIVAL, u_deg=180.0, tool=1),
    )
    hand = Sitting(in_tool=1)
    hand.here = subject.arrival
    return hand.asked(subject)


def choosing():
    rows = ("line3   EPSON T6-602S", "line4   EPSON T6-602S", "mixer   SoftMotion")
    subject = ChoiceSubject(tr("Choose"), (), rows, other=other_one())
    return Sitting().asked(subject, Question.TEXT, tr("Which cell?"))


def done():
    """A written needle, verified by a test that detects large shifts only."""
    shown = VerifyResult((Drift(90.0, 0.006, 0.004), Drift(0.0, 0.002, 0.001)), 0.1)
    (proposal,) = write_subject(1).proposals
    claim = turn_claim(proposal.result, AccuracyFacts())
    assert claim is not None
    return proved(replace(shown, judgement=held_to_claim(claim, shown)))


def done_doubtful():
    """A needle whose turn test contradicts its measurement; a person accepted a wider statement."""
    limits = DriftLimits(repeatable_mm=0.082, accurate_mm=0.082, turn_deg=90.0)
    judgement = TurnJudgement("proof_contradicts_accuracy", (limits,), wider_mm=0.145)
    shown = VerifyResult((Drift(90.0, 0.088, 0.004),), 0.1, judgement=judgement)
    return proved(replace(shown, accurate_to_mm=0.145))


def proved(proof):
    subject = write_subject(1)
    (proposal,), (verdicts,) = subject.proposals, subject.verdicts
    receipt = ToolReceipt(1, proposal.before, proposal.offset, proposal.offset)
    tool = ToolReport(proposal, receipt, proof, verdicts)
    header = Header("line3", "Change needle", needle="N-0418")
    offers = frozenset((WizardCommand.SHOW_REPORT, WizardCommand.NEXT_TOOL))
    report = ChangeReport("7f3a5c1200", (tool,))
    return ended(header, report=report, offers=offers)


def checking():
    """The list as the commands make it."""
    plan = tr(
        "The robot will move by itself {n} times: power LOW, up to {v} mm/s, at most {d} mm "
        "from here.",
        n=6,
        v=20,
        d=150,
    )
    points = (
        CheckPoint(Mark.OK, tr("Controller answers: {name}", name="T6-602S, T6S0012345, 7.5.4")),
        CheckPoint(Mark.OK, tr("Emergency stop released, guard closed, no program running")),
        CheckPoint(
            Mark.OK,
            tr(
                "All {n} tools are saved: backup of {when}",
                n=15,
                when="2026-11-20 13:58 (UTC+1)",
            ),
        ),
        CheckPoint(
            Mark.YOU,
            tr("The new nozzle is mounted and tight; tip and pin are clean"),
            "mounted",
            tr("Yes"),
        ),
        CheckPoint(Mark.YOU, tr("Nobody in the cell, hoses free"), "clear", tr("Yes")),
        CheckPoint(Mark.TO_DO, tr("Motors are off"), "motors", tr("Switch them on")),
    )
    hand = Sitting(motors=False).asked(CheckSubject(points, plan), Question.YES_NO)
    return hand.keys("2", "5", "2", "5", "2")


def remarked():
    """A finding from before the list."""
    hand = Sitting(motors=False)
    for said in (
        tr(
            "Station {station} is not known yet: run a full calibration there to find it.",
            station="P",
        ),
        tr("There is no earlier touch to repeat."),
    ):
        hand.happens(WasTold(said))
    return hand.asked(CHECK, Question.YES_NO)


def unsaved():
    """A row for information, which nothing waits for."""
    missing = tr("The tools are not saved: this computer has no backup of this controller")
    points = (CheckPoint(Mark.LOOK, missing), *CHECK.points)
    return Sitting().asked(replace(CHECK, points=points), Question.YES_NO)


def recovering():
    """A written and untested value; reading alone decides nothing."""
    options = (
        tr("The old one. Restore the old value."),
        tr("The new one. Make the turn test, then keep the new value."),
        tr("I am not sure. Keep the robot blocked and call an engineer."),
    )
    holds = tr("Tool {tool} holds the new value {now}.", tool=1, now="X 12.300 Y -3.750 Z -20.000")
    found = tr("What we read: {sentence}", sentence=holds)
    subject = ChoiceSubject(
        tr("Recover"),
        (found, tr("Tool {t} is selected.", t=0)),
        options,
        marked=None,
        enters=False,
        does=tr("Do it"),
        leaves=tr("Leave it blocked"),
    )
    question = tr("Look at the robot: which needle is mounted?")
    return Sitting(WizardState(Header("line3", "Recover"))).asked(subject, Question.TEXT, question)


def turn_test_asks():
    """The choices after a turn test that contradicts its measurement."""
    question, offered = contradicted()
    hand = Sitting(replace(Sitting().state, accepted=True), in_tool=1)
    return hand.asked(offered, Question.CHOICE, question)


def taught():
    """The proposal's effect at fifteen points."""
    (proposal,) = write_subject(1).proposals
    points: dict[int, Pose | None] = {n: Pose(20.0 * n, 200.0, -50.0, 0.0) for n in range(1, 16)}
    assert proposal.before is not None
    return impact_on(points, old=proposal.before, new=proposal.offset)


def stopped():
    error = DeclinedError(tr("You stopped it."), remedy=tr("Nothing was written."))
    note_outcome(error, ControllerOutcome(moved=True, selected=1, selected_before=1))
    command = "robolink -c line3 change needle-22g.toml"
    return ended(Header("line3", "Change needle", command=command), error)


def test_a_job_that_was_refused_for_an_earlier_one_names_recover_last():
    error = OutcomeUnknownError("Not done.", remedy="Next: 'robolink recover'.")
    shown = ended(
        Header("line3", "Change needle", command="robolink -c line3 change n.toml"), error
    )
    last = shown.state.ended
    assert last is not None
    assert last.lines[-1] == 'Next: robolink -c "line3" recover'


def test_after_an_emergency_stop_the_reset_comes_before_recover():
    error = ControllerFaultError("The emergency stop was pressed.", remedy="Release it.")
    note_outcome(error, ControllerOutcome(left_open=True, reset_first=True))
    last = ended(Header("line3", "Change needle", command="robolink change n.toml"), error)
    assert last.state.ended.lines[-1] == (
        'Next: robolink -c "line3" robot reset, then robolink -c "line3" recover'
    )
    assert str(last.state.ended.lines).count("Next:") == 1
    keys = [key for key, _ in screen_of(last.state, last.now).actions]
    assert keys == ["0"], "beginning again would be refused"


@pytest.mark.parametrize(
    ("error", "outcome", "headed"),
    [
        (ConfigError("It is a copy."), None, "NOT STARTED"),
        (ControllerFaultError("The guard is open."), ControllerOutcome(selected=1), "NOT STARTED"),
        (ControllerFaultError("The guard is open."), ControllerOutcome(moved=True), "STOPPED"),
        (DeclinedError("You stopped it."), None, "STOPPED"),
        (CalibrationError("too_few", "Too few points."), None, "STOPPED"),
    ],
)
def test_what_was_refused_before_anything_happened_was_not_stopped(error, outcome, headed):
    if outcome is not None:
        note_outcome(error, outcome)
    state = WizardState(Header("line3", "Change needle"), subject="a question before the list")
    last = ended_of(state, error, 0.0)
    assert last is not None
    assert last.kept[0].endswith(headed)
    hand = Sitting(state).happens(HasEnded(last))
    assert hand.state.ended is last
    assert headed in screen_of(hand.state, 1.0).title


def test_after_a_touch_it_was_stopped_whatever_was_refused():
    last = ended(Header("line3", "Change needle"), ControllerFaultError("The guard is open."))
    assert "STOPPED" in screen_of(last.state, last.now).title


@pytest.mark.parametrize(("role", "offered"), [("", True), ("engineer", True), ("operator", False)])
def test_an_operator_is_not_offered_what_takes_an_engineer(role, offered):
    report = done().state.report
    assert report is not None
    shown = ended(Header("line3", "Change needle"), report=replace(report, role=role))
    assert any("undo" in line for line in shown.state.ended.lines) is offered


def test_what_was_refused_is_not_proposed_again():
    error = ConfigError("The recipe is for another cell.", remedy="Nothing was sent.")
    shown = ended(Header("line3", "Change needle", command="robolink change n.toml"), error)
    assert "n.toml" not in " ".join(shown.state.ended.lines + shown.state.ended.kept)


def ended(header, error=None, report=None, offers=frozenset()):
    hand = Sitting(WizardState(header, offers=offers)).asked(touch_subject())
    if report is not None:
        hand.happens(WasRegarded(report))
    return hand.happens(HasEnded(ended_of(hand.state, error, hand.now)))


def jogging():
    box = WorkBox.around(ARRIVAL, xy_mm=50.0, below_mm=50.0, above_mm=50.0)
    return (
        Sitting(WizardState(Header("line3", "Jog")))
        .asked(JogRange(ARRIVAL, box), text="Jog the tool.")
        .keys("+", "6")
        .jogs("x+0.5")
    )


def other_one():
    """Return the language to which the key changes."""
    return CHINESE if tr("Next") == "Next" else ENGLISH


def jobs():
    """The choice of a job, with the record of each."""
    needle, two = "needle   (needle-one-touch.toml)", "two-nozzles   (two.toml)"
    when = "2026-11-20 16:12 (UTC+1)"
    summaries = (spoken(find_method(name).summary) for name in ("one-touch", "two-pose"))
    subject = ChoiceSubject(
        tr("Choose"),
        (),
        (f"{needle}   {tr('about {n} min', n=3)}", two),
        details=tuple(
            (
                summary,
                tr("Tool: {numbers}", numbers="1"),
                tr(
                    "Last change with it on this robot: {when}, needle {id}", when=when, id="N-0417"
                ),
                tr("A full calibration is due after {n} more changes.", n=6),
            )
            for summary in summaries
        ),
        other=other_one(),
    )
    return Sitting().asked(subject, Question.TEXT, tr("Which job?"))


def coming_down(*, reads=True, **other):
    """A straight descent with a good third left."""
    start = Pose(300.0, 400.0, -20.0, 90.0, tool=0)
    target = replace(start, z_mm=-80.0, **other)
    going = MoveSubject(
        target,
        Way.STRAIGHT,
        8.0,
        tr("Lowering beside the pin."),
        tr("You jog the tip into contact."),
    )
    seen = Reading(10.0, "ready", pose=replace(start, z_mm=-57.0), motors=True, low_power=True)
    hand = Sitting().happens(WasRead(replace(seen, pose=start))).happens(WasRegarded(going))
    return hand.happens(WasRead(seen if reads else replace(seen, pose=None)))


SCREENS = {
    "moving down": coming_down,
    "moving unseen": lambda: coming_down(reads=False),
    "free jog": jogging,
    "choose": choosing,
    "choose job": jobs,
    "check without backup": unsaved,
    "check": lambda: Sitting(motors=False).asked(CHECK, Question.YES_NO).keys("2", "5"),
    "moving": moving,
    "touch": touching,
    "first touch": lambda: Sitting().asked(touch_subject(number=1, arrival=None)),
    "turn test": lambda: Sitting(in_tool=1).asked(touch_subject(limit_mm=0.2, total=None)),
    "turn test more": turning_on,
    "turn test asks": turn_test_asks,
    "touch tilted": touching_tilted,
    "turn test tilted": turning_tilted,
    "values tilted": writing_tilted,
    "fit tilted": lambda: Sitting().asked(tilted_fit(), Question.YES_NO),
    "moving for long": moving_for_long,
    "fit": lambda: Sitting().asked(
        fit_subject(0.006, 0.004, 0.131, 0.007, worst=2), Question.YES_NO
    ),
    "values": lambda: Sitting().asked(write_subject(1), Question.YES_NO).keys("1"),
    "recover": recovering,
    "check list": checking,
    "values again": lambda: Sitting().asked(
        replace(write_subject(1), again=3, can_add_touch=True), Question.YES_NO
    ),
    "fit more": lambda: Sitting().asked(
        replace(fit_subject(0.006, 0.004, 0.131, 0.007, worst=2), more=True), Question.YES_NO
    ),
    "touch again": lambda: Sitting().asked(touch_subject(number=3, retakes=True, types=True)),
    "length seen": length_seen,
    "touch typed": lambda: (
        Sitting().asked(touch_subject(types=True)).keys(".").keys(*"250.112 199.954")
    ),
    "values taught": lambda: (
        Sitting()
        .happens(WasRegarded(TaughtPoints(taught())))
        .asked(replace(write_subject(1), stations={1: ("PIN-07",)}), Question.YES_NO)
    ),
    "two tools": lambda: Sitting().asked(write_subject(1, 2), Question.YES_NO),
    "five tools": lambda: Sitting().asked(write_subject(1, 2, 3, 4, 5), Question.YES_NO),
    "check remarks": remarked,
    "question": lambda: Sitting().asked(None, Question.YES_NO, "Is the valve shut?"),
    "text": lambda: Sitting().asked(None, Question.TEXT, "Id of the new needle?").keys(*"N-0418"),
    "working": Sitting,
    "done": done,
    "done doubtful": done_doubtful,
    "stopped": stopped,
}


@pytest.fixture(params=LANGUAGES)
def language(request):
    speak = {
        "en": None,
        "zh": chinese(),
        "pseudo": lambda text: f"[{text}{'~' * (2 * len(text) // 5)}]",
    }[request.param]
    assert speak is not None or request.param == "en"
    before = messages._translate
    messages.install(speak)
    yield request.param
    messages.install(before)


@pytest.mark.parametrize("name", SCREENS)
def test_a_screen_fits_a_terminal_and_its_layout_is_ascii(name, language):
    hand = SCREENS[name]()
    rows = screen_of(hand.state, hand.now).rows()
    assert len(rows) <= 24
    assert max(map(wcswidth, rows)) <= 80
    for character in "".join(rows):
        assert character.isascii() or unicodedata.east_asian_width(character) != "A", character
    told = [*told_before(hand.state), told_question(hand.state)]
    assert all(character.isascii() for character in "".join(told)) or language != "en"


@pytest.mark.parametrize("name", SCREENS)
@pytest.mark.parametrize("language", ["en", "zh"], indirect=True)
def test_nothing_of_a_screen_is_too_wide_for_its_place(name, language):
    """A screen cuts wide text, so the drawn text always fits: this checks the intended text."""
    hand = SCREENS[name]()
    screen = screen_of(hand.state, hand.now)
    left, right = screen.title
    assert wcswidth(left) + 1 + wcswidth(right) <= 80
    assert wcswidth(screen.status) <= 80
    keys = [f"[{key}] {does}" for key, does in screen.actions]
    assert sum(map(wcswidth, keys)) + 2 * (len(keys) - 1) <= 80, "a second row of keys"
    for line in screen.lines:
        # Sentences are wrapped; columns would be torn apart.
        assert "   " not in line.strip() or wcswidth(line.rstrip()) <= 80, line


@pytest.mark.parametrize("name", SCREENS)
def test_a_screen_is_the_stored_one(name, request):
    hand = SCREENS[name]()
    drawn = "\n".join(screen_of(hand.state, hand.now).rows()) + "\n"
    path = STORED / f"{name.replace(' ', '-')}.txt"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        path.write_text(drawn, encoding="ascii")
        pytest.fail(f"{path.name} was stored; look at it")
    assert drawn == path.read_text(encoding="ascii")


def test_lines_say_what_the_turn_test_has_shown_too():
    told = told_question(turning_on().state).splitlines()
    assert told[:2] == [
        "At U 90.0 it was 0.008 mm off: OK.",
        "At U 180.0 it was 0.093 mm off: too near the limit.",
    ]
    beyond = touch_subject(limit_mm=0.1, earlier=(AngleShown(90.0, 0.2, False),))
    assert told_question(Sitting().asked(beyond).state).startswith(
        "At U 90.0 it was 0.200 mm off: over the limit."
    )


def test_how_long_a_movement_takes_is_said_where_it_is_known():
    def shown(hand, later_s=0.0):
        return "\n".join(screen_of(hand.state, hand.now + later_s).rows())

    assert "To go: 23.0 mm, about 3 s" in shown(coming_down())
    # The controller reports no position meanwhile: the whole move, from its start.
    assert "Path:  60.0 mm in all, about 8 s" in shown(coming_down(reads=False))
    assert "Still" not in shown(coming_down(), later_s=1.5), "where it is now, nobody knows"
    # A tool that turns during the move has its own speed.
    for turns in ({"u_deg": 80.0}, {"v_deg": 1.0}, {"w_deg": 1.0}):
        assert "about" not in shown(coming_down(**turns))
    assert "about" not in shown(moving())
    lifting = MoveSubject(ARRIVAL, Way.STRAIGHT, 8.0, "Lifting off the pin.")
    assert "Then" not in shown(moving().happens(WasRegarded(lifting)))
    assert "Then:  Lowering beside the pin." in shown(moving())
    assert "Then:  You jog the tip into contact." in shown(coming_down())


def test_the_picture_finds_the_elbow_by_angles_alone():
    from robolink_cli.wizard.views.moving import elbow_of

    assert elbow_of(Pose(349.3, 442.9, -60.0, 0.0), SCARA) == pytest.approx((111.2, 305.4), abs=1.0)
    assert elbow_of(ARRIVAL, ()) is None
    assert elbow_of(ARRIVAL, (0.0, 0.5, 0.0)) is None
    assert elbow_of(ARRIVAL, (170.0, 120.0)) is None


@pytest.mark.parametrize(("upper", "fore"), [(400.0, 100.0), (100.0, 400.0)])
def test_either_link_of_an_arm_may_be_the_short_one(upper, fore):
    from robolink_cli.wizard.views.moving import elbow_of

    elbow = elbow_of(Pose(upper, fore, -60.0, 90.0), (0.0, 90.0))
    assert elbow == pytest.approx((upper, 0.0))


@pytest.mark.parametrize("language_of_page", ["en", "zh"])
def test_the_pictures_of_the_pages_are_those_of_the_screens(language_of_page):
    from tests.cli.wizard.pictures import SHOWN, picture

    for name in SHOWN:
        path, text = picture(name, language_of_page)
        assert path.read_text(encoding="utf-8") == text, "python -m tests.cli.wizard.pictures"


def test_the_last_row_says_what_the_main_key_does_on_the_marked_row(language):
    hand, said = checking(), []
    hand.asked(hand.state.subject, Question.YES_NO)
    for key in ("2", "2", "2", "8", "8", "5"):
        hand.keys(key)
        screen = screen_of(hand.state, hand.now)
        assert sum(row.startswith(">") for row in screen.rows()) == 1
        said.append(dict(screen.actions)["5"])
    switch, start = tr("Switch them on"), tr("Start moving ({n} open)", n=1)
    # Both rows for the person were confirmed before, so the first arrow goes to the open one.
    assert said == [switch, start, start, switch, tr("Take it back"), tr("Yes")]


@pytest.mark.parametrize("width", range(34, 42))
def test_keys_stand_at_least_two_blanks_apart(width):
    """A row has as many keys as that spacing allows; the others go into a second row."""
    keys = [("*", "x" * (width - 4)), ("#", "y" * 16), ("Esc", "z" * 14)]
    rows = list(key_rows(keys))
    shown = [f"[{key}] {does}" for key, does in keys]
    assert [cell.strip() for row in rows for cell in row.split("  ") if cell.strip()] == shown
    assert len(rows) == (1 if sum(map(len, shown)) + 4 <= 80 else 2)


def test_a_path_that_is_wider_than_the_screen_is_shown_to_its_end():
    path = "/home/cell/" + "folder/" * 20 + "end.json"
    rows = list(broken(f"Saved in {path}"))
    assert max(map(len, rows)) <= 80
    assert "".join(rows).replace(" ", "") == f"Savedin{path}"


def test_the_next_command_after_a_contradiction_learns_the_station_where_that_was_chosen():
    error = VerifyError("Contradicted.", code="proof_contradicts_accuracy")
    header = Header("line3", "Change needle", command="robolink -c line3 change n.toml")
    again = ended(header, error).state.ended
    assert again is not None
    assert again.lines[-1] == "Next: robolink -c line3 change n.toml"
    error.next_commands = "calibrate two-pose --tool 1", "cell station learn B --tool 1"
    learning = ended(header, error).state.ended
    assert learning is not None
    assert learning.lines[-2:] == (
        'Next: robolink -c "line3" calibrate two-pose --tool 1',
        'Next: robolink -c "line3" cell station learn B --tool 1',
    )


def test_lines_show_each_row_of_a_contradicted_turn_test_and_what_enter_does():
    hand = turn_test_asks()
    told = told_before(hand.state)
    assert told[0] == "  1 Restore the old value."
    assert told[2] == "  2 Make one more touch."
    assert told_question(hand.state).endswith(
        "What should happen now? [Type the number of a row. Enter alone: 1.]"
    )
