"""A calibration run: measure the new tips, write and test their offsets, or undo it.

:class:`NozzleChange` is the run, of one tool or of several on one head. :class:`RecipeRun` is the
same run with all that a recipe adds to it: questions, outputs, references, stations by name.
"""

from robolink.calibration_run._acceptance import AcceptanceCriteria
from robolink.calibration_run._forecast import Forecast
from robolink.calibration_run._length import known_height
from robolink.calibration_run._measurement import accuracy_facts, assessed_in_cell
from robolink.calibration_run._nozzle_change import DescribeReport, Earlier, NozzleChange
from robolink.calibration_run._open_turn_test import (
    OpenTurnTest,
    finish_by_turn_test,
    open_turn_tests,
    untested_sentences,
)
from robolink.calibration_run._plan import (
    ChangePlan,
    Limits,
    ToolPlan,
    clearance_too_small,
    require_contact_input,
    require_ready,
    usual_box,
)
from robolink.calibration_run._preview import (
    PlannedStep,
    flange_now,
    foresee,
    preview,
    require_inside,
)
from robolink.calibration_run._proposal import (
    ChangeReport,
    LimitVerdict,
    Listener,
    Moment,
    Proposal,
    ToolReport,
    WriteSubject,
)
from robolink.calibration_run._recipe_run import RecipeRun
from robolink.calibration_run._records import next_steps, touches_made
from robolink.calibration_run._repeatability import (
    Seating,
    height_is_known,
    seating_of,
    tip_sigma_mm,
    touching_as_recorded,
)
from robolink.calibration_run._turn_test import (
    Attended,
    TurnTestStep,
    conclude_turn_test,
    told_of_contradiction,
)

__all__ = [
    "AcceptanceCriteria",
    "Attended",
    "ChangePlan",
    "ChangeReport",
    "DescribeReport",
    "Earlier",
    "Forecast",
    "LimitVerdict",
    "Limits",
    "Listener",
    "Moment",
    "NozzleChange",
    "OpenTurnTest",
    "PlannedStep",
    "Proposal",
    "RecipeRun",
    "Seating",
    "ToolPlan",
    "ToolReport",
    "TurnTestStep",
    "WriteSubject",
    "accuracy_facts",
    "assessed_in_cell",
    "clearance_too_small",
    "conclude_turn_test",
    "finish_by_turn_test",
    "flange_now",
    "foresee",
    "height_is_known",
    "known_height",
    "next_steps",
    "open_turn_tests",
    "preview",
    "require_contact_input",
    "require_inside",
    "require_ready",
    "seating_of",
    "tip_sigma_mm",
    "told_of_contradiction",
    "touches_made",
    "touching_as_recorded",
    "untested_sentences",
    "usual_box",
]
