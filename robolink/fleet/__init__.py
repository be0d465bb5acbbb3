"""Plans for many cells: which cell does what and when, how it ended, and when a plan halts.

Nothing here carries a job out: an agent does, which asks :meth:`FleetStore.begin` before each
delivery and reports with :meth:`FleetStore.record_outcome` (docs/fleet.md).
"""

from robolink.fleet.corrections import LEAST_EARLIER, TipCorrection, corrections_of
from robolink.fleet.errors import PlanError, PlantError
from robolink.fleet.halts import HaltRule
from robolink.fleet.outcome_codes import MOST_TRIES, Treatment, pause_s, treatment_of
from robolink.fleet.plans import Plan, load_plan, plan_of
from robolink.fleet.progress import (
    CellJob,
    Halt,
    JobOutcome,
    Permit,
    PlanOverview,
    PlanProgress,
    RecordedOutcome,
    Turn,
    WaitFacts,
)
from robolink.fleet.states import JobState, PlanKind, WaitReason, state_in_words, wait_in_words
from robolink.fleet.store.database import default_plant
from robolink.fleet.store.store import FleetStore
from robolink.fleet.windows import Window

__all__ = [
    "CellJob",
    "FleetStore",
    "Halt",
    "HaltRule",
    "JobOutcome",
    "JobState",
    "LEAST_EARLIER",
    "MOST_TRIES",
    "Permit",
    "Plan",
    "PlanError",
    "PlanKind",
    "PlanOverview",
    "PlanProgress",
    "PlantError",
    "RecordedOutcome",
    "TipCorrection",
    "Treatment",
    "Turn",
    "WaitFacts",
    "WaitReason",
    "Window",
    "corrections_of",
    "default_plant",
    "load_plan",
    "pause_s",
    "plan_of",
    "state_in_words",
    "treatment_of",
    "wait_in_words",
]
