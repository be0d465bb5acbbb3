"""Plans for many cells: which cell does what and when, how it ended, and when a plan halts.

Nothing here carries a job out: an agent does, which asks :meth:`FleetStore.begin` before each
delivery and reports with :meth:`FleetStore.record_outcome` (docs/fleet.md).
"""

from robolink.fleet.corrections import LEAST_EARLIER, TipCorrection, corrections_of
from robolink.fleet.errors import PlanError, PlantError, PlantVersionError
from robolink.fleet.halts import HaltRule
from robolink.fleet.line_jobs import (
    LineJob,
    LineJobError,
    LineOrder,
    OpenLineJobsError,
    line_order_of,
    line_order_table,
)
from robolink.fleet.outcome_codes import MOST_TRIES, Treatment, pause_s, treatment_of
from robolink.fleet.plans import Plan, load_plan, plan_of
from robolink.fleet.plant_view.cell_states import CellState, RecipeInUse
from robolink.fleet.plant_view.later_proofs import proof_of
from robolink.fleet.plant_view.notes import PlanSummary, PlantLook, PlantNotes
from robolink.fleet.plant_view.plant_report import PlantReport, report_of
from robolink.fleet.progress import (
    CellJob,
    Halt,
    JobOutcome,
    Permit,
    PlanOverview,
    PlanProgress,
    PlantHome,
    RecordedOutcome,
    Turn,
    WaitFacts,
)
from robolink.fleet.states import (
    JobState,
    PlanKind,
    WaitReason,
    kind_in_words,
    state_in_words,
    wait_in_words,
)
from robolink.fleet.store.database import default_plant
from robolink.fleet.store.line_jobs import LineJobStore
from robolink.fleet.store.store import FleetStore
from robolink.fleet.windows import Window

__all__ = [
    "CellJob",
    "CellState",
    "FleetStore",
    "Halt",
    "HaltRule",
    "JobOutcome",
    "JobState",
    "LEAST_EARLIER",
    "LineJob",
    "LineJobError",
    "LineJobStore",
    "LineOrder",
    "MOST_TRIES",
    "OpenLineJobsError",
    "Permit",
    "Plan",
    "PlanError",
    "PlanKind",
    "PlanOverview",
    "PlanProgress",
    "PlanSummary",
    "PlantError",
    "PlantHome",
    "PlantLook",
    "PlantNotes",
    "PlantReport",
    "PlantVersionError",
    "RecipeInUse",
    "RecordedOutcome",
    "TipCorrection",
    "Treatment",
    "Turn",
    "WaitFacts",
    "WaitReason",
    "Window",
    "corrections_of",
    "default_plant",
    "kind_in_words",
    "line_order_of",
    "line_order_table",
    "load_plan",
    "pause_s",
    "plan_of",
    "proof_of",
    "report_of",
    "state_in_words",
    "treatment_of",
    "wait_in_words",
]
