"""An error on a screen takes three lines of 80 columns, besides what is listed, in each language.

``tests/packaging/test_error_sentences.py`` measures all sentences with likely values. Here errors
are made whose parts come from several places, as long as they become.
"""

from inspect import getattr_static

import pytest
from robolink_cli.commands.computer.checkup import Level, Remark
from robolink_cli.console.error_lines import LONGEST_NAME, MOST_LINES, counted, error_lines
from robolink_cli.console.shell_words import SHELL_WAYS
from robolink_cli.console.tables import SCREEN
from robolink_cli.unfit_packages import MOST_NAMED, cannot_run, how_to_fit

from robolink import ToolOffset
from robolink.accuracy import learning_commands
from robolink.calibration import Drift, TurnClaim, VerifyResult, solve_two_pose
from robolink.calibration.quality.given_poses import ToolFit
from robolink.calibration_run import AcceptanceCriteria, Proposal, conclude_turn_test
from robolink.calibration_run._turn_test import Attended, touches_counting
from robolink.controller_outcome import ControllerOutcome, ToolOutcome
from robolink.controllers import SimpleController
from robolink.controllers.driver_link import advise_emergency_stop
from robolink.errors import CalibrationError, RobolinkError, TransportTimeoutError
from robolink.journal.store.failures import damaged_error, journal_error
from robolink.journal.store.migrations import newer_error
from robolink.locale.languages import speak
from robolink.messages import LIST_LINE, in_english, install, joined, listed, tr
from robolink.methods import CameraSource, PointsSource
from robolink.methods.given_poses import PosesFound
from robolink.model import Pose, outcome_sentences, settling_command
from robolink.pose_tables import read_poses
from robolink.remedy_words import speaking
from robolink.stations import StationKind

JOURNAL = "/home/kowalski/.local/share/robolink/journal.db"
LONG = "postgresql+psycopg://robolink@journal-server.plant.example:5432/robolink"
TOUCHES = Pose(298, 99, -60, 0), Pose(322, 91, -60, 180)
CLAIM = TurnClaim(
    look_sigma_mm=0.003,
    offset_sigma_mm=0.003,
    headings_deg=(0,),
    finds_place=False,
    place_u_mm=0.0115,
    accurate_mm=0.028,
)


@pytest.fixture(params=["en", "zh"])
def language(request):
    """Speaks it, in the words of a shell."""
    assert speak(request.param)
    with speaking(SHELL_WAYS):
        yield request.param
    install(None)


def raised(act, *given, **named):
    """Return the error that a call raises."""
    with pytest.raises(RobolinkError) as caught:
        act(*given, **named)
    return caught.value


def lines_of(error):
    """Return what a terminal shows, and how many lines of it count."""
    shown = error_lines(error.what, error.remedy, width=SCREEN)
    return shown.split("\n"), counted(shown)


def by_pose_files(better=None):
    """Return poses that exist already, one of whose tools may fit better."""
    source = PointsSource(lambda: ())
    if better is not None:
        source.found = PosesFound(solve_two_pose(*TOUCHES), (), ToolFit(better, 0.1))
    return source.remedy


@pytest.mark.parametrize(
    "remedy",
    [
        by_pose_files,
        lambda: by_pose_files(12),
        lambda: getattr_static(CameraSource, "remedy").fget(None),
        str,
    ],
)
def test_a_refused_jump(language, remedy):
    stored = ToolOffset(909, -4, -20)
    proposal = Proposal(1, stored, solve_two_pose(*TOUCHES, stored=stored))
    limits = AcceptanceCriteria(max_change_mm=200, accepted_with="--accept-jump")
    error = raised(limits.judge_change, proposal, remedy=remedy())
    lines, count = lines_of(error)
    assert 2 <= count <= 3, lines
    assert "--accept-jump" in lines[-1]


@pytest.mark.parametrize("row", range(4))
@pytest.mark.parametrize("u_deg", [180, -112.5])
def test_a_turn_test_that_ends_with_the_step_that_a_person_chose(language, row, u_deg):
    relearning = learning_commands("BEAMS-02", StationKind.BEAMS, tool=15)
    attended = Attended(
        lambda _question, _rows: min(row, 2), lambda _question: False, None, tuple(relearning)
    )
    drifts = VerifyResult((Drift(u_deg, 0.101, 0),), tolerance_mm=0.2)
    error = raised(
        conclude_turn_test, SimpleController(), 1, drifts, claim=CLAIM, attended=attended
    )
    lines, count = lines_of(error)
    assert count <= 3, lines
    if error.next_commands:
        told = "".join(" ".join(lines).split())
        assert all("".join(f"'robolink {one}'".split()) in told for one in relearning)


@pytest.mark.parametrize("many", [1, MOST_NAMED, 40])
def test_packages_that_do_not_fit(language, many):
    unfit = [
        Remark(f"pack{n}", Level.BAD, "is not installed.", f"Run: python -m pip install 'p{n}>=1'")
        for n in range(many)
    ]
    what, remedy = cannot_run(unfit, ImportError("no such thing. " * 40)), how_to_fit()
    lines, count = lines_of(RobolinkError(what, remedy=remedy))
    assert count == 2, lines
    assert len(lines) <= MOST_NAMED + 4
    assert f"{LIST_LINE}pack0: is not installed. Run: python -m pip install 'p0>=1'" in lines


@pytest.mark.parametrize("name", [JOURNAL, LONG])
def test_a_journal_whose_path_is_long(language, name):
    stands, then = tr("The command was not sent."), tr("Then run 'robolink recover'.")
    broken = OSError(f"connection to server at {name} failed. " * 4)
    for error in (
        journal_error(broken, name, stands, then),
        journal_error(PermissionError(JOURNAL), name, stands, then),
        damaged_error("database disk image is malformed " * 4, name, stands),
        newer_error(name, 8),
    ):
        lines, count = lines_of(error)
        assert count <= 3, lines
        assert f"{LIST_LINE}{name}" in lines, "it can be copied"


@pytest.mark.parametrize(
    "text",
    [
        "300,100,-60,0,0,0,1\n310,110,-60,0,0,0,1\n",
        "x,y,z,a,b,c\n300,100,-60,0,0,0\n",
        "x,y,u\n0.3,0.1,3.1\n0.31,0.11,3.1\n",
        "name,x,y,z,rx,ry,rz\nA,0.3,0.1,-0.06,1,1,1\nB,0.31,0.11,-0.06,1,1,2\n",
        ",".join(map(str, range(1, 31))) + "\n",
    ],
)
def test_a_file_of_poses_that_leaves_questions_open(language, tmp_path, text):
    path = tmp_path / "touches of the needle.csv"
    path.write_text(text, encoding="utf-8")
    error = raised(read_poses, path)
    lines, count = lines_of(error)
    assert count <= 3, lines
    options = ("--columns", "--length", "--euler")
    assert len(error.asks) == sum(error.remedy.count(option) for option in options)


def carried(cause):
    """Yield the errors that say what another one says."""
    controller = SimpleController()
    yield controller._link.markers.unproved("TLSet 1, XY(12.324,-3.729,-20.000,0.000)", cause)
    yield advise_emergency_stop(RobolinkError(cause.what, remedy=cause.remedy))


def test_what_another_error_says_is_listed(language):
    cause = TransportTimeoutError("It did not answer. " * 7, remedy="Check this and that. " * 7)
    for error in carried(cause):
        lines, count = lines_of(error)
        assert count <= 3, lines


def test_a_touch_that_was_not_made_in_a_turn_test(language):
    before = tr("Nothing was written.")
    remedy = listed(before + " Jog the tip onto it.", [])

    def act():
        with touches_counting(SimpleController()):
            raise CalibrationError("not_touched", "Touch 1 was not made. " * 6, remedy=remedy)

    error = raised(act)
    assert lines_of(error)[1] == 2
    assert before not in error.remedy


def test_what_stands_is_listed_below_what_happened():
    error = RobolinkError("It broke.", remedy="Mend it.")
    for sentence in ("", "Tool 1 has its old value.", "Output 5 is on."):
        error.say_what_stands(sentence)
    assert error.what == "It broke.\n    Tool 1 has its old value.\n    Output 5 is on."
    assert str(error) == f"{error.what}\nMend it."
    assert in_english(error.what) == error.what


def test_what_else_to_do_is_said_behind_what_to_do():
    error = RobolinkError("It broke.")
    for sentence in ("", "Mend it.", "", "Then test it."):
        error.advise(sentence)
    assert error.remedy == "Mend it. Then test it."


def test_the_last_advice_gives_way_where_there_is_no_room(language):
    error = RobolinkError("It ended before. " * 8, remedy="Mend it. Wait for it to end.")
    error.advise(tr("You can run 'robolink recover' again."))
    shown = error_lines(error.what, error.remedy, then="Next: robolink reset", width=SCREEN)
    assert counted(shown) == 3 or error.remedy in shown, shown
    assert shown.endswith("Next: robolink reset")
    error.advise("Wait longer, or until somebody has looked at all that this says.")
    shown = error_lines(error.what, error.remedy, width=SCREEN)
    assert counted(shown) == 3
    assert shown.split("\n  ")[-1].startswith("Mend it. Wait for it to end.")
    assert "somebody" not in shown


def test_an_error_without_words_still_says_what_to_do():
    assert error_lines("", "Wait.", width=SCREEN) == "robolink: \n  Wait."
    assert error_lines("", width=0) == "robolink: "


def test_a_remedy_stands_below_a_list_in_a_traceback():
    assert str(RobolinkError("2 errors:\n    a\n    b", remedy="Mend it.")).endswith("b\nMend it.")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (f"{JOURNAL} is empty.", f"journal.db is empty.\n    {JOURNAL}"),
        (f"It is in '{JOURNAL}'.", f"It is in 'journal.db'.\n    {JOURNAL}"),
        (f"{JOURNAL}, {JOURNAL}.", f"journal.db, journal.db.\n    {JOURNAL}"),
        (f"{JOURNAL} has 2 errors:\n    a\n    b", f"has 2 errors:\n    {JOURNAL}\n    a\n    b"),
        (f"日志 {JOURNAL}\uff1a磁盘已满。", f"日志 journal.db\uff1a磁盘已满。\n    {JOURNAL}"),
        (f"文件{JOURNAL}。", f"文件journal.db。\n    {JOURNAL}"),
        (
            f"{LONG} has a newer form.",
            f"robolink@journal-ser...robolink has a newer form.\n    {LONG}",
        ),
        (
            "softmotion+modbus-tcp://192.168.0.10:502?unit=255 is silent.",
            "192.168.0.10:502 is silent.\n    softmotion+modbus-tcp://192.168.0.10:502?unit=255",
        ),
        (
            r"C:\ProgramData\robolink\cells\robolink.toml is empty.",
            "robolink.toml is empty.\n    C:\\ProgramData\\robolink\\cells\\robolink.toml",
        ),
    ],
)
def test_a_long_name_is_listed_whole_and_named_in_the_sentence(text, shown):
    assert error_lines(text, width=SCREEN).endswith(shown)
    assert error_lines(text, width=0) == f"robolink: {text}", "a file, or a program that searches"


@pytest.mark.parametrize(
    "text",
    [
        f"/{'x' * (LONGEST_NAME - 1)} is empty.",
        f"Run 'robolink config check {JOURNAL}'.",
        "/home/K. van der Berg/.local/share/robolink/journal.db is empty.",
        r"C:\Users\K Sato\AppData\Local\robolink\journal.db is empty.",
        "TCP/IP and/or 1/2 of the inputs/outputs/markers/registers/coils were read.",
    ],
)
def test_what_would_be_torn_or_is_typed_stays_whole(text):
    assert error_lines(text, width=200) == f"robolink: {text}"


OUTCOMES = {
    "looked": ControllerOutcome(selected=1, selected_before=1, selection_known=True),
    "moved": ControllerOutcome(moved=True, selected=12, selected_before=1, selection_known=True),
    "lost": ControllerOutcome(
        moved=True,
        moving=("Move XY(287.500, 103.250, -104.000, 180.000)",),
        doubtful=("SetIO,8,1",),
        left_open=True,
    ),
    "two tools": ControllerOutcome(
        tools={
            tool: ToolOutcome(
                before=(12.335, -3.732, -20.0, 0.0, 0.0, 0.0),
                requested=(12.5, -3.5, -20.0, 0.0, 0.0, 0.0),
                holds=(12.5, -3.5, -20.0, 0.0, 0.0, 0.0),
                known=tool == 1,
            )
            for tool in (1, 2)
        },
        carried_out=("SetIO,8,1", "SetIO,9,1"),
        left_open=True,
    ),
}


@pytest.mark.parametrize("outcome", OUTCOMES.values(), ids=OUTCOMES)
@pytest.mark.parametrize(("what", "do"), [(1, 1), (1, 2), (2, 1), (2, 0), (1, 0)])
def test_what_stands_is_listed_where_there_is_no_room(language, outcome, what, do):
    happened, remedy = (" ".join(["It ended before."] * 4 * many) for many in (what, do))
    stands, then = outcome_sentences(outcome), settling_command(outcome)
    shown = error_lines(happened, remedy, stands=stands, then=then, width=SCREEN)
    assert counted(shown) <= MOST_LINES, shown
    flat = "".join(shown.split())
    places = [flat.index("".join(one.split())) for one in (happened, *stands)]
    assert places == sorted(places)
    assert flat.endswith("".join((then or remedy or stands[-1]).split()))
    assert flat.count("Itendedbefore") > 4 * what or not do or what + do > 2, "as much as fits"
    at_once = error_lines(happened, remedy, stands=stands, then=then, width=0)
    assert at_once.split("\n")[1].strip() == joined(" ", stands)
