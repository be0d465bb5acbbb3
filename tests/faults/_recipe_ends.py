"""Conditions after a recipe's run was ended from outside, and after its recovery."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from robolink.model import EntryKind, Marker, MarkerKind, begun_in_words
from tests._commands import Ended
from tests.faults._recipe_cell import RecipeCell


@dataclass
class Disturbance:
    """One disturbance, once.

    Attributes:
        asked: The number of movements requested before it; -1 while it has not occurred.
    """

    cell: RecipeCell
    how: str
    asked: int = -1

    @property
    def came(self) -> bool:
        """Whether it has occurred."""
        return self.asked >= 0

    def __call__(self) -> None:
        """Cause the disturbance."""
        self.asked = self.cell.moves_asked()
        self.cell.disturb(self.how)


def check_interrupted(cell: RecipeCell, ended: Ended, disturbance: Disturbance) -> None:
    """Ctrl-C ends a run with everything restored, or with all tested values kept."""
    assert ended.code == 130, (ended.code, ended.err)
    check_nothing_was_repeated(cell, disturbance)
    assert cell.stops_asked() <= 1
    assert cell.open_markers() == (), ended.err
    assert cell.selected == 1
    assert cell.settings() == cell.settings_before
    whole = check_all_or_none(cell)
    check_writes(cell)
    if whole:
        numbers = ", ".join(map(str, cell.recipe_tools))
        said = f"Tool {numbers} keeps the new value|The controller has stored tool 1"
        assert re.search(said, ended.err + ended.out), ended.err
    else:
        assert cell.changed() == set(), ended.err
        for tool in set(cell.writes()):
            assert f"The old value of tool {tool} is back" in ended.err
    cell.check_outputs_are_named(ended.err, early=ended.code != 0)


def check_stopped(cell: RecipeCell, ended: Ended, disturbance: Disturbance) -> None:
    """A controller that can no longer be commanded is left as it is, and everything is named."""
    check_nothing_was_repeated(cell, disturbance)
    assert cell.stops_asked() <= 1
    check_writes(cell)
    markers = cell.open_markers()
    if ended.code == 0:
        assert markers == ()
        assert cell.selected == 1
        assert check_all_or_none(cell)
    else:
        assert ended.code in (5, 6), (ended.code, ended.err)
    check_markers_are_named(markers, ended)
    check_the_selected_tool_is_named(cell, ended)
    if cell.changed() and not kept(cell):
        assert {marker.kind for marker in markers} & {MarkerKind.CHANGE, MarkerKind.SET}
        assert "recover" in ended.err
    cell.check_outputs_are_named(ended.err, early=ended.code != 0)


def check_put_right(cell: RecipeCell, disturbance: Disturbance, *, offered: bool) -> None:
    """After the reset one command recovers what reading can, and with --yes the rest."""
    found = {marker.kind for marker in cell.open_markers()}
    cell.make_ready(disturbance.how)
    if offered:
        looked = cell.run("status", asks=True)
        assert looked.code == 0, looked.err
        assert cell.selected == 1, looked.err
    recovered = cell.run("recover")
    assert recovered.code == (6 if cell.open_markers() else 0), recovered.err
    if recovered.code:
        assert {marker.kind for marker in cell.open_markers()} <= {MarkerKind.MOVE, MarkerKind.SET}
        recovered = cell.run("recover", "--yes")
        assert recovered.code == 0, recovered.err
    assert cell.open_markers() == ()
    assert cell.selected == 1
    if MarkerKind.SELECTION in found:
        assert cell.settings() == cell.settings_before
    if not check_all_or_none(cell):
        assert cell.changed() == set()
    check_writes(cell)
    assert cell.moves_begun <= disturbance.asked
    cell.check_motion_is_allowed()


def check_nothing_was_repeated(cell: RecipeCell, disturbance: Disturbance) -> None:
    """The robot has stopped, and began no movement requested after the disturbance."""
    assert not cell.moving, "the robot still moves"
    assert cell.strange() == []
    assert cell.moves_begun <= disturbance.asked, "a movement after it"
    # A client that reads before it asks may be overtaken once; the controller refuses then.
    assert cell.moves_asked() <= disturbance.asked + 1


def check_all_or_none(cell: RecipeCell) -> bool:
    """All tools hold new values and that is recorded, or none does and nothing is."""
    whole = kept(cell)
    if whole:
        assert cell.changed() == set(cell.recipe_tools)
    return whole


def check_writes(cell: RecipeCell) -> None:
    """Each tool was written once at most, and once more where its old value was restored."""
    for tool, count in Counter(cell.writes()).items():
        assert count <= (1 if tool in cell.changed() else 2), (tool, count)


def kept(cell: RecipeCell) -> bool:
    """Whether it is recorded that every tool keeps its tested value."""
    done = list(cell.journal.entries(kinds=(EntryKind.DONE,)))
    proved = {entry.tool for entry in done if entry.verdict == "verified"}
    assert proved in (set(), set(cell.recipe_tools)), proved
    assert cell.journal.verify().problems == ()
    return bool(proved)


def check_the_selected_tool_is_named(cell: RecipeCell, ended: Ended) -> None:
    """If the cell's own tool is not selected, or may not be, marker and message say so."""
    markers = [m for m in cell.open_markers() if m.kind is MarkerKind.SELECTION]
    if not markers:
        assert cell.selected == 1, ended.err
        return
    (marker,) = markers
    assert marker.details["tool"] == 1
    now = marker.details["now"]
    # A selection under way: both tools are named.
    asked = {m.details.get("select", now) for m in cell.open_markers()} - {now}
    assert cell.selected in {now, *asked}, "the markers name another tool"
    known = [cell.selected] if cell.shows_its_tool else [*asked, now]
    named = " or ".join(map(str, known))
    sentence = (
        "Tool 1 is selected, as before."
        if named == "1"
        else f"Tool {named} is selected now; it was tool 1 before."
    )
    assert sentence in ended.err, ended.err


def check_markers_are_named(markers: Sequence[Marker], ended: Ended) -> None:
    """The end of the run names everything that is left open."""
    for marker in markers:
        named = (marker.request, begun_in_words(marker))
        assert any(words in ended.err for words in named), (marker, ended.err)
