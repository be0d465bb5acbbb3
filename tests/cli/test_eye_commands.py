"""eye look and eye collect, as a person types them; no camera but files and a drawn one."""

import json
import signal
from contextlib import nullcontext

import numpy as np
import pytest
from PIL import Image
from robolink_cli import main
from robolink_cli.commands.measure.eye import watch as watching
from robolink_cli.commands.measure.eye.look import MOST_LISTED
from robolink_cli.commands.measure.eye.watch import Focus, watch_line

from robolink.eye.candidate import Candidate, CandidateRefusal, RefusalCode
from robolink.eye.record.collection import read_collection
from robolink.eye.record.png import png_of
from tests.eye._drawn_tips import SIZE_PX, drawn_tip
from tests.eye.drawings import drawing


@pytest.fixture(autouse=True)
def own_folders(state_folder):
    """Each test has its own state and working folder."""


@pytest.fixture(scope="module")
def tip_picture(tmp_path_factory):
    """A picture with one tip, as a PNG file."""
    path = tmp_path_factory.mktemp("tips") / "tip.png"
    path.write_bytes(png_of(drawn_tip()))
    return str(path)


@pytest.fixture(scope="module")
def empty_picture(tmp_path_factory):
    """A picture without a tip."""
    path = tmp_path_factory.mktemp("tips") / "empty.png"
    path.write_bytes(png_of(drawn_tip(radius_px=0.0)))
    return str(path)


@pytest.fixture
def robolink(capsys):
    """Run a command; return the exit code and the output."""

    def ran(*arguments):
        code = main.run(list(arguments))
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return ran


def test_a_picture_is_looked_at_and_told_in_words(robolink, tip_picture):
    code, out, err = robolink("eye", "look", "--picture", tip_picture, "--diameter-px", "44")
    assert code == 0, err
    assert out.splitlines()[0].startswith("1: X 160.")
    assert ": accepted" in out
    assert out.splitlines()[-1] == "One tip found."


def test_the_document_has_each_candidate_with_its_reasons(robolink, tip_picture, tmp_path):
    page = tmp_path / "look.html"
    words = ("--picture", tip_picture, "--diameter-px", "44", "--out", str(page), "--json")
    code, out, _ = robolink("cell", "eye", "look", *words)
    document = json.loads(out)
    assert code == 0
    assert document["accepted"] == 1
    assert (document["width_px"], document["height_px"]) == SIZE_PX
    first = document["candidates"][0]
    assert (first["x_px"], first["y_px"]) == (pytest.approx(160, abs=1), pytest.approx(120, abs=1))
    assert first["refused"] == []
    text = page.read_text(encoding="utf-8")
    assert text.count("<figure>") == 2  # the whole picture, and the tip larger
    assert text.count("<circle") > len(document["candidates"])
    assert "data:image/png;base64," in text
    assert "<script" not in text


def test_the_best_few_are_listed_and_all_where_they_are_asked_for(robolink, tmp_path):
    """Without a radius every size is looked for, and most of what is found is refused."""
    (tmp_path / "screws.png").write_bytes(png_of(drawing(24, (160, 120)).grey))
    words = ("eye", "look", "--picture", str(tmp_path / "screws.png"))
    everything = json.loads(robolink(*words, "--json")[1])["candidates"]
    accepted = sum(not one["refused"] for one in everything)
    listed = max(MOST_LISTED, accepted)
    assert len(everything) > listed + 1
    lines = robolink(*words)[1].splitlines()
    assert [line.split(":")[0] for line in lines[:listed]] == [
        str(number) for number in range(1, listed + 1)
    ]
    assert lines[listed] == f"{len(everything) - listed} more were refused: --all lists them."
    assert len(robolink(*words, "--all")[1].splitlines()) == len(everything) + 1


def test_no_tip_is_exit_code_1_and_says_why(robolink, empty_picture):
    code, out, _ = robolink("eye", "look", "--picture", empty_picture, "--diameter-px", "44")
    assert code == 1
    assert "No tip found" in out


def test_a_png_has_the_circles_and_the_lines_below(robolink, tip_picture, tmp_path):
    path = tmp_path / "look.png"
    words = ("--picture", tip_picture, "--diameter-px", "44", "--out", str(path))
    assert robolink("eye", "look", *words)[0] == 0
    with Image.open(path) as image:
        drawn = np.asarray(image)
    assert drawn.shape[1] >= SIZE_PX[0]
    assert drawn.shape[0] > SIZE_PX[1]
    green = (drawn[:, :, 1].astype(int) - drawn[:, :, 0]) > 60
    y, x = np.nonzero(green[: SIZE_PX[1]])
    assert (x.min() + x.max()) / 2 == pytest.approx(160, abs=8)
    assert (y.min() + y.max()) / 2 == pytest.approx(120, abs=8)
    assert robolink("eye", "look", *words)[0] == 2  # it is there already
    assert robolink("eye", "look", *words, "--force")[0] == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["look"], "No camera is named"),
        (["look", "--picture", "gone.png"], "gone.png"),
        (["look", "--picture", "a.png", "--sensor", "folder:///x"], "two sources"),
        (["look", "--picture", "a.png", "--out", "look.jpg"], ".html or .png"),
        (["look", "--picture", "a.png", "--watch"], "does not change"),
        (["look", "--sensor", "folder:///x", "--count", "3"], "--watch"),
        (["look", "--sensor", "folder:///x", "--watch", "--out", "x.html"], "--out"),
        (["look", "--sensor", "folder:///x", "--diameter-px", "2"], "diameter-px"),
        (["look", "--sensor", "vision-guide"], "by itself"),
        (["collect", "d", "--picture", "a.png", "--truth", "1,2,3", "--no-tip"], "contradict"),
        (["collect", "d", "--picture", "a.png", "--truth", "1,2"], "no mark"),
        (["collect", "d", "--picture", "a.png", "--truth", "nan,2,3"], "no mark"),
        (["collect", "d", "--picture", "a.png", "--truth", "1,2,-3"], "no mark"),
    ],
)
def test_what_makes_no_sense_is_a_usage_error(robolink, words, said):
    code, _, err = robolink("eye", *words)
    assert code == 2, err
    assert said in err


def test_a_picture_that_is_none_is_refused_by_name(robolink, tmp_path):
    (tmp_path / "page.png").write_text("<html>please log in</html>")
    code, out, _ = robolink("eye", "look", "--picture", "page.png", "--json")
    assert (code, json.loads(out)["error"]["code"]) == (7, "picture_unreadable")


def test_a_camera_that_is_not_there_is_exit_code_7(robolink):
    code, out, _ = robolink("eye", "look", "--sensor", "folder:///nowhere/at/all", "--json")
    assert (code, json.loads(out)["error"]["code"]) == (7, "camera_gone")


def test_a_picture_is_collected_with_its_truth(robolink, tip_picture, tmp_path):
    words = ("--picture", tip_picture, "--diameter-px", "44", "--truth", "160.4,120.1,22", "--json")
    code, out, err = robolink("eye", "collect", str(tmp_path / "set"), *words)
    document = json.loads(out)
    assert code == 0, err
    assert document["answer"] == "right"
    assert document["off_px"] == [pytest.approx(0.41, abs=0.4)]
    (one,) = read_collection(tmp_path / "set")
    assert one.tips[0].x_px == 160.4
    assert one.shape.radius_px == 22.0
    assert robolink("eye", "collect", str(tmp_path / "set"), *words[:4], "--no-tip")[0] == 0
    assert sorted(len(one.tips) for one in read_collection(tmp_path / "set")) == [0, 1]


def test_nobody_to_mark_it_is_declined_and_saves_nothing(robolink, tip_picture, tmp_path):
    folder = tmp_path / "set"
    assert robolink("eye", "collect", str(folder), "--picture", tip_picture)[0] == 9
    assert not folder.exists()


def test_a_mark_outside_the_picture_saves_nothing(robolink, tip_picture, tmp_path):
    folder = tmp_path / "set"
    words = ("--picture", tip_picture, "--truth", "310,120,22")
    code, _, err = robolink("eye", "collect", str(folder), *words)
    assert code == 2
    assert "--no-tip" in err
    assert list(folder.iterdir()) == []


def candidate(edge_px, *, refused=()):
    return Candidate(160.0, 120.0, 22.0, 0.9, edge_px=edge_px, refused=refused)


def test_a_watched_line_says_whether_it_gets_sharper():
    focus = Focus()
    said = [watch_line([candidate(edge)], focus) for edge in (4.0, 3.0, 3.05, 3.6)]
    assert "edge 4.00 px" in said[0]
    assert "sharper" in said[1]
    assert "the same" in said[2]
    assert "blurrier" in said[3]
    assert (focus.best_px, focus.last_px) == (3.0, 3.6)


def test_a_watched_line_names_what_keeps_a_tip_from_being_accepted():
    refused = (CandidateRefusal(RefusalCode.BLURRED, 9.0, 5.0),)
    line = watch_line([candidate(9.0, refused=refused)], Focus())
    assert line.startswith("no tip:")
    assert "out of focus" in line


def test_watching_ends_in_order_by_ctrl_c(robolink, monkeypatch):
    """Ctrl-C arrives while it waits for the next picture; what was best is told."""

    class Eye:
        settings = None

        def __init__(self):
            self.taken = 0

        def glance(self):
            self.taken += 1
            return type("Look", (), {"candidates": (candidate(4.0 - 0.5 * self.taken),)})()

    eye = Eye()

    class View:
        camera = eye
        shape = type("Shape", (), {"radius_px": 22.0})()

    monkeypatch.setattr(watching, "viewing", lambda context, which: nullcontext(View()))

    def pause(seconds):
        assert seconds <= 1 / watching.AT_MOST_HZ
        if eye.taken == 3:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("time.sleep", pause)
    code, out, err = robolink("eye", "look", "--sensor", "folder:///x", "--watch")
    assert code == 0, err
    assert out.splitlines()[-1] == "Narrowest edge: 2.50 px."
    assert eye.taken == 3
