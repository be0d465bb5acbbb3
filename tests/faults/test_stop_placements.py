"""`stop()` from a second thread, at every distinct point of a whole `recalibrate`.

A point is a kind of checkpoint (a lock, an exchange, a commit, a question, a step), its subject,
and the step of the procedure. After the acknowledgement there is no movement, no output, no write
and no success, except that tool, power and speed are restored and each tool of an open change once
(docs/reference/rules.md 5).

By default a sample is used. ``ROBOLINK_ALL_KILL_POINTS=1`` uses all; ``pytest -s`` counts them.
"""

import os
import re
from collections import Counter
from dataclasses import dataclass, field

import pytest

from robolink.model import MarkerKind
from tests._commands import Ended
from tests.faults._recipe_cases import CASES, Case
from tests.faults._recipe_cell import RecipeCell
from tests.faults._recipe_ends import check_markers_are_named, kept
from tests.faults._recipe_instants import Instants
from tests.faults._stop_placements import Placement, Placements

pytestmark = pytest.mark.timeout(7200)

_SAMPLE = 5


@dataclass
class AtRest:
    """The state of the machine when the stop was acknowledged."""

    cell: RecipeCell
    moves: int = -1
    where: object = None
    writes: list[int] = field(default_factory=list)
    outputs: object = None
    requests: int = 0

    def __call__(self) -> None:
        """Record the state."""
        cell = self.cell
        assert not cell.moving, "the stop was acknowledged while the robot moves"
        self.moves, self.where = cell.moves_begun, cell.where()
        self.writes, self.outputs = cell.writes(), dict(cell.outputs())
        self.requests = len(cell.requests())


def stopped(case: Case, at: Placement, folder) -> None:
    with case.cell() as cell:
        rest = AtRest(cell)
        placements = Placements(at, rest)
        with placements.watching():
            ended = case.run(cell, folder, Instants())
        assert rest.moves >= 0, f"the point was not reached: {ended.code} {ended.err}"
        assert placements.acknowledged, placements.refused
        check_nothing_went_on(cell, ended, rest)
        check_said(cell, ended)


def check_nothing_went_on(cell: RecipeCell, ended: Ended, rest: AtRest) -> None:
    assert cell.moves_begun == rest.moves, "a movement after the stop"
    assert cell.where() == rest.where, "the robot is elsewhere"
    assert dict(cell.outputs()) == rest.outputs, "an output was switched after the stop"
    after = Counter(cell.writes()) - Counter(rest.writes)
    assert all(count == 1 for count in after.values()), after
    for tool in after:
        assert cell.tools()[tool] == cell.before[tool], "a write that is no roll-back"
    # A value that could not be restored outranks the stop (docs/commands.md).
    unproved = {marker.kind for marker in cell.open_markers()} - {MarkerKind.SELECTION}
    assert ended.code == (6 if unproved else 10), (ended.code, ended.err)
    if not cell.changed():
        return
    if kept(cell):
        said = "keeps the new value|controller has stored tool"
        assert re.search(said, ended.err + ended.out), ended.err
    else:
        assert MarkerKind.CHANGE in unproved, "a value stays that nobody knows of"


def check_said(cell: RecipeCell, ended: Ended) -> None:
    """What could not be restored is named, and one command after the reset recovers it."""
    check_markers_are_named(cell.open_markers(), ended)
    if cell.selected != 1 or cell.open_markers():
        assert cell.run("reset").code == 0
        if cell.run("recover").code:
            recovered = cell.run("recover", "--yes")
            assert recovered.code == 0, recovered.err
        assert cell.selected == 1
        assert cell.open_markers() == ()
        assert not cell.changed() or kept(cell)


@pytest.fixture(scope="module")
def placements(tmp_path_factory):
    """Returns the distinct points of a whole run of each recipe, which is checked first."""
    known: dict[str, list[Placement]] = {}

    def of(name: str) -> list[Placement]:
        if name not in known:
            case, whole = CASES[name], Placements()
            with case.cell() as cell:
                with whole.watching():
                    ended = case.run(cell, tmp_path_factory.mktemp("whole"), Instants())
                assert ended.code == 0, ended.err
                assert cell.changed() == set(case.tools)
            known[name] = list(whole.distinct)
        return known[name]

    return of


@pytest.mark.parametrize(
    "name",
    # Two tools take every step that one takes; an OPC UA server takes a second to come up.
    [pytest.param(n, marks=pytest.mark.soak if "one" in n or "OPC" in n else ()) for n in CASES],
)
def test_after_a_stop_nothing_goes_on(tmp_path, placements, name):
    whole = placements(name)
    everything = os.environ.get("ROBOLINK_ALL_KILL_POINTS") == "1"
    # Spread over the run; coprime to the few points that one step has.
    chosen = whole if everything else whole[:: max(1, len(whole) // _SAMPLE) | 1]
    failures: list[str] = []
    for at in chosen:
        try:
            stopped(CASES[name], at, tmp_path)
        except AssertionError as error:
            failures.append(f"stopped at {at}: {error}")
            print(failures[-1])  # noqa: T201 - for whoever waits an hour for all of them
    print(f"{name}: {len(chosen)} placements of {len(whole)}")  # noqa: T201 - for pytest -s
    assert not failures, f"{len(failures)} of {len(chosen)}:\n" + "\n\n".join(failures[:8])
