"""Acts on the wire: its log, commanded motions, faults."""

from dataclasses import asdict
from typing import Any, Final, get_args

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.timing import NS_PER_S
from robolink_simulators.cell.clock import ManualClock, SteeredClock
from robolink_simulators.control.answers import (
    CellTruth,
    ClockShown,
    Counters,
    FaultsTold,
    LinesTold,
    MapTruth,
    MotionsTold,
    SnapshotNames,
)
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.control.declared_acts import Answer, ControlAct, Given, Taken
from robolink_simulators.faults import (
    FaultAction,
    FaultNotPossibleError,
    PlcFaultAction,
    fault_as_keys,
    faults_of_table,
)
from robolink_simulators.faults.counted import MOST_FIRED
from robolink_simulators.faults.fieldbus import Order
from robolink_simulators.faults.links import LinkKind
from robolink_simulators.not_now import NotNowError

_MOST_PENDING: Final = 10_000
_MOST_TOLD: Final = 2000
_AFTER: Final = Taken("after", needed=False, least=0, most=1e15)
_ACTIONS: Final = tuple(sorted({action.name.lower() for action in (*FaultAction, *PlcFaultAction)}))


def _log(cell: ControlledCell, given: Given) -> Answer:
    """Return the traffic on the wire, passwords hidden; with a number only what came after it."""
    log = cell.simulator.log
    return {"lines": [asdict(line) for line in log.lines(_number(given))], "last": log.added}


def _motions(cell: ControlledCell, given: Given) -> Answer:
    """Return the motions that began, whoever commanded them, and where the flange was to end."""
    motions = [asdict(motion) for motion in cell.simulator.motions(_number(given))]
    return {"motions": motions, "moves_started": cell.simulator.counters()["moves_started"]}


def _number(given: Given) -> int:
    return int(given.get("after", 0))


def _faults(cell: ControlledCell, _given: Given) -> Answer:
    """Return the planned faults that have happened, and those that wait."""
    faults = cell.simulator.faults
    pending = faults.pending
    return {
        "fired": [fault_as_keys(fault) for fault in faults.fired[-MOST_FIRED:]],
        "times_fired": faults.times_fired,
        "pending": [fault_as_keys(fault) for fault in pending[:_MOST_TOLD]],
        "waiting": len(pending),
    }


def _add_fault(cell: ControlledCell, given: Given) -> Answer:
    """Plan a fault for requests that match, as docs/fault-plans.md explains; times in a row."""
    table: dict[str, Any] = dict(given)
    times, first = table.pop("times", 1), table.get("on_exchange", 0)
    if times > 1 and table.get("every"):
        raise ConfigError(
            tr("A fault that goes on until it is removed happens no certain number of times."),
            remedy=tr("Give either times or every."),
        )
    tables = [{**table, "on_exchange": first + further} for further in range(times)]
    planned: Any = cell.simulator.faults
    wait = len(planned.pending)
    if wait + times > _MOST_PENDING:
        raise NotNowError(
            tr("{count} faults wait already.", count=wait),
            remedy=tr("Let them happen, or forget them with clear_faults."),
        )
    for fault in _possible(tables, cell.links):
        planned.add(fault)
    return _faults(cell, {})


def _possible(tables: list[dict[str, Any]], links: tuple[LinkKind, ...]) -> tuple[Any, ...]:
    """Return the faults for the first of the links on which they can happen."""
    try:
        for link in links[:-1]:
            try:
                return faults_of_table(tables, link)
            except FaultNotPossibleError:
                continue
        return faults_of_table(tables, links[-1])
    except ConfigError as error:
        # Values that some faults have, but none on this link: a bit of a word on a link of bytes.
        raise NotNowError(error.what, remedy=error.remedy) from error


def _clear_faults(cell: ControlledCell, _given: Given) -> Answer:
    """Remove all planned faults; those that happened stay in the list."""
    cell.simulator.faults.clear()
    return _faults(cell, {})


WIRE_ACTS: Final = (
    ControlAct("log", _log, (_AFTER,), reads=True, gives=LinesTold),
    ControlAct("motions", _motions, (_AFTER,), reads=True, gives=MotionsTold),
    ControlAct("faults", _faults, reads=True, gives=FaultsTold),
    ControlAct(
        "add_fault",
        _add_fault,
        (
            Taken("action", "text", choices=_ACTIONS),
            Taken("match", "text", needed=False),
            Taken("on_exchange", "whole", needed=False),
            Taken("times", "whole", needed=False, least=1, most=1000),
            Taken("seconds", needed=False, least=0, most=86_400),
            Taken("position", "whole", needed=False),
            Taken("bit", "whole", needed=False, most=15),
            Taken("code", "whole", needed=False),
            Taken("order", "text", needed=False, choices=get_args(Order)),
            Taken("every", "whole", needed=False, most=1_000_000),
        ),
        gives=FaultsTold,
    ),
    ControlAct("clear_faults", _clear_faults, gives=FaultsTold),
)
"""Acts on the wire."""


_MOST_SNAPSHOTS: Final = 100
_NAME: Final = Taken("name", "text")


def _truth(cell: ControlledCell, _given: Given) -> Answer:
    """Return where the tips and the pin really are, and what the controller holds."""
    return cell.simulator.truth()


def _counters(cell: ControlledCell, _given: Given) -> Answer:
    """Return the number of exchanges, motions, tool writes, starts and touches."""
    return {**cell.simulator.counters()}


def _restart(cell: ControlledCell, _given: Given) -> Answer:
    """Switch the controller off and on; what it retains stays."""
    cell.simulator.restart()
    return {}


def _reset(cell: ControlledCell, _given: Given) -> Answer:
    """Make the controller and its world anew, under another identity; faults are removed."""
    cell.simulator.reset()
    return {}


def _snapshot(cell: ControlledCell, given: Given) -> Answer:
    """Store the present state of controller and world under a name."""
    if given["name"] not in cell.moments and len(cell.moments) >= _MOST_SNAPSHOTS:
        raise NotNowError(
            tr("There are {count} snapshots already.", count=len(cell.moments)),
            remedy=tr("Take one under a name that there is."),
        )
    cell.moments[given["name"]] = cell.simulator.kept_moment()
    return {"snapshots": sorted(cell.moments)}


def _restore(cell: ControlledCell, given: Given) -> Answer:
    """Restore the state stored under a name, at rest, with nobody connected."""
    moment = cell.moments.get(given["name"])
    if moment is None:
        raise NotNowError(
            tr("There is no snapshot {name!r}.", name=given["name"]),
            remedy=tr("Take one first."),
        )
    cell.simulator.go_back(moment)
    return {}


def _clock(cell: ControlledCell, _given: Given) -> Answer:
    """Return the simulated time, and the simulated seconds per real second; 0 is a pause."""
    factor = cell.clock.factor if isinstance(cell.clock, SteeredClock) else None
    return {"simulated_s": cell.simulator.now_ns / NS_PER_S, "factor": factor}


def _set_clock(cell: ControlledCell, given: Given) -> Answer:
    """Run simulated time at a factor of real time from now on; 0 pauses it."""
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
"""Acts on time and memory."""
