"""The nozzle change: measure the new tips, write their offsets, prove them, or undo it."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.nozzle_change._acceptance import AcceptanceCriteria as AcceptanceCriteria
    from robolink.nozzle_change._accuracy import accuracy_facts as accuracy_facts
    from robolink.nozzle_change._accuracy import assessed_in_cell as assessed_in_cell
    from robolink.nozzle_change._change import DescribeReport as DescribeReport
    from robolink.nozzle_change._change import Earlier as Earlier
    from robolink.nozzle_change._change import NozzleChange as NozzleChange
    from robolink.nozzle_change._length import known_height as known_height
    from robolink.nozzle_change._pin_record import next_steps as next_steps
    from robolink.nozzle_change._plan import ChangePlan as ChangePlan
    from robolink.nozzle_change._plan import Limits as Limits
    from robolink.nozzle_change._plan import ToolPlan as ToolPlan
    from robolink.nozzle_change._plan import clearance_too_small as clearance_too_small
    from robolink.nozzle_change._plan import require_contact_input as require_contact_input
    from robolink.nozzle_change._plan import require_ready as require_ready
    from robolink.nozzle_change._plan import usual_box as usual_box
    from robolink.nozzle_change._preview import PlannedStep as PlannedStep
    from robolink.nozzle_change._preview import flange_now as flange_now
    from robolink.nozzle_change._preview import foresee as foresee
    from robolink.nozzle_change._preview import preview as preview
    from robolink.nozzle_change._preview import require_inside as require_inside
    from robolink.nozzle_change._proposal import ChangeReport as ChangeReport
    from robolink.nozzle_change._proposal import LimitVerdict as LimitVerdict
    from robolink.nozzle_change._proposal import Listener as Listener
    from robolink.nozzle_change._proposal import Moment as Moment
    from robolink.nozzle_change._proposal import Proposal as Proposal
    from robolink.nozzle_change._proposal import ToolReport as ToolReport
    from robolink.nozzle_change._proposal import WriteSubject as WriteSubject
    from robolink.nozzle_change._records import touches_made as touches_made
    from robolink.nozzle_change._seating import Seating as Seating
    from robolink.nozzle_change._seating import height_is_known as height_is_known
    from robolink.nozzle_change._seating import seating_of as seating_of
    from robolink.nozzle_change._seating import tip_sigma_mm as tip_sigma_mm
    from robolink.nozzle_change._seating import touching_as_recorded as touching_as_recorded
    from robolink.nozzle_change._turn_question import Attended as Attended
    from robolink.nozzle_change._turn_question import TurnTestStep as TurnTestStep
    from robolink.nozzle_change._turn_verdict import conclude_turn_test as conclude_turn_test
    from robolink.nozzle_change._turn_verdict import told_of_contradiction as told_of_contradiction
    from robolink.nozzle_change.open_turn_test.finishing import (
        finish_by_turn_test as finish_by_turn_test,
    )
    from robolink.nozzle_change.open_turn_test.marking import OpenTurnTest as OpenTurnTest
    from robolink.nozzle_change.open_turn_test.marking import open_turn_tests as open_turn_tests
    from robolink.nozzle_change.open_turn_test.untested import (
        untested_sentences as untested_sentences,
    )

__getattr__ = lazy_exports(
    __name__,
    {
        "_acceptance": "AcceptanceCriteria",
        "_accuracy": "accuracy_facts assessed_in_cell",
        "_change": "DescribeReport Earlier NozzleChange",
        "_length": "known_height",
        "open_turn_test.finishing": "finish_by_turn_test",
        "open_turn_test.marking": "OpenTurnTest open_turn_tests",
        "open_turn_test.untested": "untested_sentences",
        "_plan": "ChangePlan Limits ToolPlan clearance_too_small require_contact_input "
        "require_ready usual_box",
        "_preview": "PlannedStep flange_now foresee preview require_inside",
        "_pin_record": "next_steps",
        "_proposal": "ChangeReport LimitVerdict Listener Moment Proposal ToolReport WriteSubject",
        "_records": "touches_made",
        "_seating": "Seating height_is_known seating_of tip_sigma_mm touching_as_recorded",
        "_turn_question": "Attended TurnTestStep",
        "_turn_verdict": "conclude_turn_test told_of_contradiction",
    },
)
