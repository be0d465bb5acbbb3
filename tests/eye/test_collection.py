"""Pictures that a site collects, their marks, and what an answer of the finder is worth."""

import json
from datetime import UTC, datetime

import numpy as np
import pytest

from robolink.errors import ConfigError
from robolink.eye.cameras.decoding import decoded
from robolink.eye.candidate import Candidate, CandidateRefusal, RefusalCode, TipShape
from robolink.eye.record.collection import (
    FinderAnswer,
    MarkedTip,
    answer_to,
    read_collection,
    save_collected,
    tally,
)

AT = datetime(2026, 11, 30, 7, 8, 12, tzinfo=UTC)
TIP, OTHER = MarkedTip(100.0, 80.0, 20.0), MarkedTip(200.0, 80.0, 20.0)
GREY = np.arange(40 * 30, dtype=np.uint16).reshape(30, 40).astype(np.uint8)


def found(x_px: float, y_px: float = 80.0, *, refused: bool = False) -> Candidate:
    why = (CandidateRefusal(RefusalCode.NO_BORE, 0.1, 0.5),) if refused else ()
    return Candidate(x_px, y_px, 20.0, 0.9, refused=why)


@pytest.mark.parametrize(
    ("tips", "candidates", "answer"),
    [
        ([TIP], [found(102.5)], "right"),
        ([TIP], [found(102.5), found(160.0, refused=True)], "right"),
        ([TIP], [], "none"),
        ([TIP], [found(100.0, refused=True)], "none"),
        ([TIP], [found(103.5)], "wrong"),
        ([TIP], [found(100.0), found(160.0)], "several"),
        ([TIP], [found(100.0), found(101.0)], "several"),
        ([TIP], [found(160.0), found(180.0)], "wrong"),
        ([TIP, OTHER], [found(100.0), found(200.0)], "right"),
        ([TIP, OTHER], [found(100.0)], "wrong"),
        ([TIP, OTHER], [], "none"),
        ([], [], "right"),
        ([], [found(100.0)], "wrong"),
    ],
)
def test_an_answer_is_worth(tips, candidates, answer):
    assert answer_to(tips, candidates) == answer


def save(folder, tips=(TIP,), **shape):
    return save_collected(
        folder,
        GREY,
        tips,
        shape=TipShape(20.0, **shape),
        at=AT,
        camera="http://cam/",
        candidates=[found(100.0)],
        robolink_version="0",
        marked_by="mei",
    )


def test_what_was_saved_is_read_again(tmp_path):
    save(tmp_path, bore=False)
    save(tmp_path, ())
    first, second = read_collection(tmp_path)
    assert first.path.name == "20261130-070812-2.png"
    assert (first.tips, second.tips) == ((), (TIP,))
    assert second.shape == TipShape(20.0, bore=False)
    assert second.camera == "http://cam/"
    assert (decoded(second.path.read_bytes(), "x") == GREY).all()


def test_a_picture_without_marks_is_left_out(tmp_path):
    save(tmp_path).path.with_suffix(".json").unlink()
    assert read_collection(tmp_path) == ()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "robolink/eye-picture/2"}, "schema"),
        ({"picture": "../../etc/passwd"}, "name of a file"),
        ({"picture": "gone.png"}, "gone.png"),
        ({"tips": [{"x_px": 1.0, "y_px": 2.0}]}, "radius_px"),
        ({"tips": [{"x_px": 1.0, "y_px": 2.0, "radius_px": 0.0}]}, "radius"),
        ({"tips": [{"x_px": "left", "y_px": 2.0, "radius_px": 3.0}]}, "left"),
        ({"shape": {"polarity": "white", "radius_px": 3.0}}, "white"),
        ({"tips": None}, "NoneType"),
    ],
)
def test_a_wrong_mark_is_refused_with_its_file(tmp_path, change, said):
    path = save(tmp_path).path.with_suffix(".json")
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ConfigError, match=r"20261130-070812\.json") as refused:
        read_collection(tmp_path)
    assert said in refused.value.what


@pytest.mark.parametrize("text", ["", "[]", "{", '"x"', "\x00"])
def test_a_file_that_is_no_mark_is_refused_with_its_name(tmp_path, text):
    save(tmp_path).path.with_suffix(".json").write_text(text)
    with pytest.raises(ConfigError, match=r"20261130-070812\.json"):
        read_collection(tmp_path)


def test_a_folder_that_is_missing_is_named(tmp_path):
    with pytest.raises(ConfigError, match="nowhere"):
        read_collection(tmp_path / "nowhere")


def test_answers_are_counted_with_their_pictures(tmp_path):
    pictures = [save(tmp_path), save(tmp_path, ()), save(tmp_path, (OTHER,))]
    counted = tally(pictures, lambda one: [found(100.0)])
    assert {answer: len(paths) for answer, paths in counted.items()} == {
        FinderAnswer.RIGHT: 1,
        FinderAnswer.NONE: 0,
        FinderAnswer.SEVERAL: 0,
        FinderAnswer.WRONG: 2,
    }
    assert counted[FinderAnswer.WRONG] == [pictures[1].path, pictures[2].path]
