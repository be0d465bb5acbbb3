"""Pictures out of a folder: only those count that appeared after the question and are whole."""

import os
from collections.abc import Callable

import pytest

from robolink.errors import CalibrationError, ConfigError
from robolink.eye.cameras.folder import FolderSource
from robolink.eye.opening import open_source
from robolink.timing import NS_PER_S
from tests.eye._picture_servers import Scene, encoded, pgm

DAY_S = 86400


class Happenings:
    """A clock on which things happen: each sleep makes the next of them come true."""

    def __init__(self, *deeds: Callable[[], object], late: int = 0):
        self._now_ns = 0
        self.deeds = [lambda: None] * late + list(deeds)

    def now_ns(self):
        return self._now_ns

    def sleep(self, seconds):
        self._now_ns += int(seconds * NS_PER_S)
        if self.deeds:
            self.deeds.pop(0)()


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "pictures"


@pytest.fixture
def written(folder):
    """Return a writer of files into the folder, and what each of them shows."""
    folder.mkdir()
    scene = Scene()

    class Writer:
        def __init__(self):
            self.shown = {}

        def __call__(self, name, *, share=1.0, mode="wb", data=None, age_s=0.0):
            if data is None:
                grey = scene()
                data = encoded(grey) if name.endswith("png") else pgm(grey)
                self.shown[name] = grey
            path = folder / name
            with open(path, mode) as file:
                file.write(data[: int(len(data) * share)])
            if age_s:
                there = path.stat()
                os.utime(path, (there.st_atime - age_s, there.st_mtime - age_s))
            return data

    return Writer()


def taken(folder, *deeds, late=0):
    return FolderSource(folder, clock=Happenings(*deeds, late=late)).take()


def refused(folder, *deeds):
    with pytest.raises(CalibrationError) as raised:
        taken(folder, *deeds)
    assert raised.value.remedy
    return raised.value.code


def nothing():
    """Let a moment pass."""


def test_a_picture_that_appears_after_the_question_is_the_answer(folder, written):
    written("old.png")
    picture = taken(folder, lambda: written("new.png"), late=3)
    assert picture.name == "new.png"
    assert (picture.grey == written.shown["new.png"]).all()


@pytest.mark.parametrize("age_s", [0.0, DAY_S, -DAY_S, 365 * DAY_S])
def test_times_in_files_make_no_difference(folder, written, age_s):
    written("ahead.png", age_s=-DAY_S)
    assert taken(folder, lambda: written("new.png", age_s=age_s)).name == "new.png"


def test_no_picture_that_was_there_ever_counts(folder, written):
    written("old.png")
    written("older.PNG", age_s=DAY_S)

    def touched():
        os.utime(folder / "old.png", (5, 5))

    def renamed():
        os.rename(folder / "older.PNG", folder / "zzz.png")

    def linked():
        os.link(folder / "zzz.png", folder / "zzzz.png")

    # A file whose time is set anew may have been written to: its first whole picture is none.
    assert refused(folder, touched, renamed, linked) == "picture_late"
    assert refused(folder) == "picture_late"


def test_a_file_that_was_half_written_when_the_question_came_is_none(folder, written):
    whole = written("a.pgm", share=0.4)

    def its_end():
        with open(folder / "a.pgm", "ab") as file:
            file.write(whole[int(len(whole) * 0.4) :])

    assert refused(folder, its_end) == "picture_late"


def test_nor_under_its_final_name(folder, written):
    whole = written("a.tmp", data=pgm(Scene()()), share=0.4)

    def done():
        with open(folder / "a.tmp", "ab") as file:
            file.write(whole[int(len(whole) * 0.4) :])
        os.rename(folder / "a.tmp", folder / "a.pgm")

    assert refused(folder, done) == "picture_late"


def test_a_file_that_is_still_being_written_is_waited_for(folder, written):
    whole = pgm(Scene()())

    def more(upto):
        def write():
            written("a.pgm", data=whole, share=upto)

        return write

    def stands():
        return [nothing] * 4

    picture = taken(
        folder, more(0.3), *stands(), more(0.6), *stands(), more(0.99), *stands(), more(1.0)
    )
    assert picture.encoded == whole


def test_a_file_counts_only_once_it_has_stayed_as_it_is(folder, written):
    contents: list[bytes] = []

    def write():
        contents.append(written("a.pgm"))

    picture = taken(folder, write, write)
    assert picture.encoded == contents[1]


def test_a_file_that_is_overwritten_counts_from_its_second_picture_on(folder, written):
    written("live.pgm")
    first = []

    def again():
        first.append(written("live.pgm"))

    picture = taken(folder, again, *[nothing] * 4, again)
    assert picture.encoded == first[1]
    # Its end alone never makes a second one, however slowly it comes.
    whole = written("live.pgm", share=0.2)

    def end(since, upto):
        def write():
            with open(folder / "live.pgm", "ab") as file:
                file.write(whole[int(len(whole) * since) : int(len(whole) * upto)])

        return write

    slowly = [end(0.2, 0.5), *[nothing] * 4, end(0.5, 0.9), *[nothing] * 4, end(0.9, 1.0)]
    assert refused(folder, *slowly) == "picture_late"


def test_a_new_file_in_place_of_an_old_one_counts(folder, written):
    written("live.pgm")

    def replaced():
        written("next.tmp", data=pgm(Scene()()))
        os.replace(folder / "next.tmp", folder / "live.pgm")

    assert taken(folder, replaced).name == "live.pgm"


def test_numbers_of_files_that_are_given_again_do_no_harm(folder, written):
    for n in range(5):
        written(f"{n}.pgm")

    def deleted():
        for n in range(5):
            (folder / f"{n}.pgm").unlink()

    def new():
        for n in range(5, 10):
            written(f"{n}.pgm")

    assert taken(folder, deleted, nothing, nothing, new).name in written.shown


def test_what_stays_half_is_unreadable_and_what_is_no_picture_is_not_looked_at(folder, written):
    assert refused(folder, lambda: written("a.png", share=0.5)) == "picture_unreadable"
    assert refused(folder, lambda: written("notes.txt", data=b"hello")) == "picture_late"
    assert refused(folder, lambda: (folder / "sub.png").mkdir()) == "picture_unreadable"
    assert refused(folder, lambda: (folder / "b.png").symlink_to("nowhere")) == "picture_late"


def test_a_whole_picture_counts_beside_one_that_stays_half(folder, written):
    def both():
        written("zz.png", share=0.5)
        written("aa.png")

    assert taken(folder, both).name == "aa.png"


def test_a_file_may_be_called_like_an_address(folder, written):
    name = "http:%2f%2fme:correct-horse@cam?x=.png"
    assert taken(folder, lambda: written(name)).name == name


def test_a_folder_that_is_gone_is_a_camera_that_is_gone(folder, written, tmp_path):
    def unplugged():
        os.rename(folder, tmp_path / "elsewhere")

    assert refused(folder, nothing, unplugged) == "camera_gone"
    assert refused(tmp_path / "never") == "camera_gone"


def test_the_folder_of_an_address(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert open_source(f"folder://{tmp_path}/a%20b").identity == f"folder {tmp_path}/a b"
    assert open_source("folder://here/below").identity == "folder here/below"
    for url in ("folder://", "folder:///", "folder:///a?b=c"):
        with pytest.raises(ConfigError):
            open_source(url)
