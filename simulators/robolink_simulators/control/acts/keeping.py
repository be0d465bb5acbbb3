"""What tests do between two looks: the truth, snapshots, time."""

from typing import Final

from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ManualClock, SteeredClock
from robolink_simulators.control.acts.answers import (
    CellTruth,
    ClockShown,
    Counters,
    MapTruth,
    SnapshotNames,
)
from robolink_simulators.control.acts.declared import Answer, ControlAct, Given, Taken
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.not_now import NotNowError

_MOST_SNAPSHOTS: Final = 100
_NAME: Final = Taken("name", "text")


def _truth(cell: ControlledCell, _given: Given) -> Answer:
    """Tell where the tips and the pin really are, and what the controller holds."""
    return cell.simulator.truth()


def _counters(cell: ControlledCell, _given: Given) -> Answer:
    """Tell how many exchanges, motions, writes of tools, starts and touches there were."""
    return {**cell.simulator.counters()}


def _restart(cell: ControlledCell, _given: Given) -> Answer:
    """Switch the controller off and on; what it keeps over that stays."""
    cell.simulator.restart()
    return {}


def _reset(cell: ControlledCell, _given: Given) -> Answer:
    """Make the controller and its world anew, under another identity; faults are forgotten."""
    cell.simulator.reset()
    return {}


def _snapshot(cell: ControlledCell, given: Given) -> Answer:
    """Keep under a name what controller and world are now."""
    if given["name"] not in cell.moments and len(cell.moments) >= _MOST_SNAPSHOTS:
        raise NotNowError(
            tr("There are {count} snapshots already.", count=len(cell.moments)),
            remedy=tr("Take one under a name that there is."),
        )
    cell.moments[given["name"]] = cell.simulator.kept_moment()
    return {"snapshots": sorted(cell.moments)}


def _restore(cell: ControlledCell, given: Given) -> Answer:
    """Be again what was kept under a name, at rest, with nobody connected."""
    moment = cell.moments.get(given["name"])
    if moment is None:
        raise NotNowError(
            tr("There is no snapshot {name!r}.", name=given["name"]),
            remedy=tr("Take one first."),
        )
    cell.simulator.go_back(moment)
    return {}


def _clock(cell: ControlledCell, _given: Given) -> Answer:
    """Tell the simulated time, and how many simulated seconds a real one has; 0 is a pause."""
    factor = cell.clock.factor if isinstance(cell.clock, SteeredClock) else None
    return {"simulated_s": cell.simulator.now_ns / NS_PER_S, "factor": factor}


def _set_clock(cell: ControlledCell, given: Given) -> Answer:
    """Let simulated time run at a factor of real time from now on; 0 pauses it."""
    if not isinstance(cell.clock, SteeredClock):
        raise NotNowError(
            tr("The time of this simulator passes only while somebody waits for it."),
            remedy=tr("Serve it on a port, or let time pass with the act step."),
        )
    cell.clock.run(given["factor"])
    return _clock(cell, {})


def _step(cell: ControlledCell, given: Given) -> Answer:
    """Let so many simulated seconds pass at once, whether time is paused or not."""
    clock = cell.clock
    if isinstance(clock, (SteeredClock, ManualClock)):
        clock.advance(given["seconds"])
        cell.simulator.advance(clock.now_ns())
    else:
        raise NotNowError(
            tr("The time of this simulator cannot be stepped."),
            remedy=tr("Serve it by 'robolink sim'."),
        )
    return _clock(cell, {})


KEEPING_ACTS: Final = (
    ControlAct("truth", _truth, reads=True, gives=CellTruth | MapTruth),
    ControlAct("counters", _counters, reads=True, gives=Counters),
    ControlAct("restart", _restart),
    ControlAct("reset", _reset),
    ControlAct("snapshot", _snapshot, (_NAME,), gives=SnapshotNames),
    ControlAct("restore", _restore, (_NAME,)),
    ControlAct("clock", _clock, reads=True, gives=ClockShown),
    ControlAct("set_clock", _set_clock, (Taken("factor", least=0, most=1000),), gives=ClockShown),
    ControlAct("step", _step, (Taken("seconds", least=0, most=86_400),), gives=ClockShown),
)
"""Acts upon time and memory."""
