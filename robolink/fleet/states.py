"""What the jobs of a plan do, how they stand, and why one waits: one table for every view."""

from enum import StrEnum
from typing import Final

from robolink.messages import declared, spoken


class PlanKind(StrEnum):
    """What the cells of a plan do."""

    BACKUP = "backup"
    CHECK = "check"
    DRIFT = "drift"
    RECIPE = "recipe"
    OFFSET = "offset"
    NOZZLE_CHANGE = "nozzle_change"

    @property
    def reads(self) -> bool:
        """Whether a job of it changes nothing at a controller: it needs no permit, rings or yes."""
        return self in (PlanKind.BACKUP, PlanKind.CHECK, PlanKind.DRIFT)

    @property
    def moves(self) -> bool:
        """Whether a robot moves, so that each job waits for a yes that is given at its cell."""
        return self in (PlanKind.RECIPE, PlanKind.NOZZLE_CHANGE)


class JobState(StrEnum):
    """How a job stands; the values are those of JSON documents and metrics."""

    WAITING = "waiting"
    RUNNING = "running"
    KEPT = "kept"
    UNPROVED = "unproved"
    REFUSED = "refused"
    UNSETTLED = "unsettled"
    MISSED = "missed"
    CANCELLED = "cancelled"

    @property
    def final(self) -> bool:
        """Whether nothing more comes of the job."""
        return self not in (JobState.WAITING, JobState.RUNNING)

    @property
    def answered(self) -> bool:
        """Whether the cell did what the plan asked."""
        return self in (JobState.KEPT, JobState.UNPROVED)


class WaitReason(StrEnum):
    """Why a job waits. Several may hold: the first in this order is the one that is shown."""

    HALTED = "halted"
    PAUSE = "pause"
    RING = "ring"
    WINDOW = "window"
    PERMIT = "permit"
    HOME = "home"
    CELL_OFF = "cell_off"
    CELL_BUSY = "cell_busy"
    BUDGET = "budget"
    TURN = "turn"
    PERSON = "person"


_KINDS: Final = {
    PlanKind.BACKUP: declared("backup"),
    PlanKind.CHECK: declared("cell check"),
    PlanKind.DRIFT: declared("drift report"),
    PlanKind.RECIPE: declared("recipe"),
    PlanKind.OFFSET: declared("offset"),
    PlanKind.NOZZLE_CHANGE: declared("nozzle change"),
}

_STATES: Final = {
    JobState.WAITING: declared("waiting"),
    JobState.RUNNING: declared("running"),
    JobState.KEPT: declared("done, on record"),
    JobState.UNPROVED: declared("written, unproved until a turn test"),
    JobState.REFUSED: declared("refused; a person has to look"),
    JobState.UNSETTLED: declared("unsettled; next: robolink recover"),
    JobState.MISSED: declared("missed: the cell was busy or did not answer in time"),
    JobState.CANCELLED: declared("cancelled"),
}

_WAITS: Final = {
    WaitReason.HALTED: declared("the plan is halted"),
    WaitReason.PAUSE: declared("a person has to let this ring begin"),
    WaitReason.RING: declared("an earlier ring is not finished"),
    WaitReason.WINDOW: declared("the plan's window is closed"),
    WaitReason.PERMIT: declared("no permit holds now"),
    WaitReason.HOME: declared("its home, which is another computer, or where no agent is heard"),
    WaitReason.CELL_OFF: declared("the cell does not answer; it will be tried again"),
    WaitReason.CELL_BUSY: declared("the cell is busy; it will be tried again"),
    WaitReason.BUDGET: declared("as many cells are at work as the plan allows"),
    WaitReason.TURN: declared("nothing: it is next"),
    WaitReason.PERSON: declared("a person at the cell, who begins it"),
}


def kind_in_words(kind: PlanKind) -> str:
    """Return what a person is told of a kind of plan."""
    return spoken(_KINDS[kind])


def state_in_words(state: JobState) -> str:
    """Return what a person is told about a state."""
    return spoken(_STATES[state])


def wait_in_words(why: WaitReason) -> str:
    """Return what a job waits for, in words."""
    return spoken(_WAITS[why])
