"""The nozzle change: measure the new tips, write their offsets, prove them, or undo it."""

from robolink.nozzle_change._acceptance import AcceptanceCriteria
from robolink.nozzle_change._accuracy import accuracy_facts, assessed_in_cell
from robolink.nozzle_change._change import DescribeReport, Earlier, NozzleChange
from robolink.nozzle_change._length import known_height
from robolink.nozzle_change._pin_record import next_steps
from robolink.nozzle_change._plan import (
    ChangePlan,
    Limits,
    ToolPlan,
    clearance_too_small,
    require_contact_input,
    require_ready,
    usual_box,
)
from robolink.nozzle_change._preview import (
    PlannedStep,
    flange_now,
    foresee,
    preview,
    require_inside,
)
from robolink.nozzle_change._proposal import (
    ChangeReport,
    LimitVerdict,
    Listener,
    Moment,
    Proposal,
    ToolReport,
    WriteSubject,
)
from robolink.nozzle_change._records import touches_made
from robolink.nozzle_change._seating import (
    Seating,
    height_is_known,
    seating_of,
    tip_sigma_mm,
    touching_as_recorded,
)
from robolink.nozzle_change._turn_question import Attended, TurnTestStep
from robolink.nozzle_change._turn_verdict import conclude_turn_test, told_of_contradiction
from robolink.nozzle_change.open_turn_test.finishing import finish_by_turn_test
from robolink.nozzle_change.open_turn_test.marking import OpenTurnTest, open_turn_tests
from robolink.nozzle_change.open_turn_test.untested import untested_sentences

__all__ = [
    "AcceptanceCriteria",
    "Attended",
    "ChangePlan",
    "ChangeReport",
    "DescribeReport",
    "Earlier",
    "LimitVerdict",
    "Limits",
    "Listener",
    "Moment",
    "NozzleChange",
    "OpenTurnTest",
    "PlannedStep",
    "Proposal",
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
