"""Why a written value keeps no turn test, and what proves it, for a person."""

from collections.abc import Iterator

from robolink.messages import joined, tr
from robolink.model import Controller, Marker, MarkerKind, Verdict
from robolink.nozzle_change.open_turn_test.marking import UNTESTED, tests_of
from robolink.transaction import Settler


def untested_sentences(controller: Controller) -> list[str]:
    """Return of each written change that keeps no turn test why, and what measures and tests anew.

    Args:
        controller: The controller, connected.

    Raises:
        RobolinkError: It cannot be read.
    """
    settler = Settler(controller, keep=True, only_looks=True)
    told = list[str]()
    for marker in controller.outcomes.open_markers():
        if marker.kind is not MarkerKind.CHANGE or tests_of(marker):
            continue
        if settler.examine(marker).verdict is Verdict.DONE:
            told += _whys(marker)
    return told


def _whys(marker: Marker) -> Iterator[str]:
    """Yield a sentence for each tool of a change whose test cannot be made now."""
    untested = marker.details.get(UNTESTED)
    if not isinstance(untested, dict):
        yield tr("Nothing is on record about how this change was to be tested.")
        return
    for tool, entry in untested.items():
        method, why = str(entry.get("method", "")), str(entry.get("why", ""))
        yield joined(" ", (_why(tool, method, why), _anew(method, why)))


def _why(tool: str, method: str, why: str) -> str:
    sentences = {
        "no_motion": tr(
            "Tool {tool} was measured from poses that existed already: nothing moves in that, so "
            "there is no turn test.",
            tool=tool,
        ),
        "not_wanted": tr("Tool {tool} was written without a turn test, as was asked.", tool=tool),
        "no_box": tr(
            "Nothing says how far the robot may go in the turn test of tool {tool}.", tool=tool
        ),
        "camera_open": tr(
            "A program had opened the camera that measured tool {tool}: it cannot be opened from "
            "here.",
            tool=tool,
        ),
        "camera_token": tr(
            "The address of the camera that measured tool {tool} holds a token, which is kept "
            "nowhere.",
            tool=tool,
        ),
    }
    return sentences.get(why) or tr(
        "{method}, which measured tool {tool}, keeps no turn test.", method=method, tool=tool
    )


def _anew(method: str, why: str) -> str:
    """Return which command measures and tests, when this is settled."""
    by_motion = "two-pose" if why == "no_motion" else method
    return tr(
        "When this is settled, 'robolink calibrate {method}' measures and tests it.",
        method=by_motion,
    )
