"""Values and interfaces. No I/O."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.model._arguments import checks_arguments as checks_arguments
    from robolink.model._arguments import misgiven as misgiven
    from robolink.model._arguments import not_of_class as not_of_class
    from robolink.model._change_limits import ChangeGuard as ChangeGuard
    from robolink.model._change_limits import ChangeLimits as ChangeLimits
    from robolink.model._change_limits import PersonRole as PersonRole
    from robolink.model._change_limits import refuse_operator as refuse_operator
    from robolink.model._change_limits import require_engineer as require_engineer
    from robolink.model._controller import ACCELERATION_RANGE_MM_S2 as ACCELERATION_RANGE_MM_S2
    from robolink.model._controller import Act as Act
    from robolink.model._controller import AlarmList as AlarmList
    from robolink.model._controller import Capabilities as Capabilities
    from robolink.model._controller import Controller as Controller
    from robolink.model._controller import DigitalIo as DigitalIo
    from robolink.model._controller import PointReader as PointReader
    from robolink.model._controller import Value as Value
    from robolink.model._controller import ValueReceipt as ValueReceipt
    from robolink.model._controller import ValueT as ValueT
    from robolink.model._controller import VariableTable as VariableTable
    from robolink.model._controller import are_simulated_facts as are_simulated_facts
    from robolink.model._controller import is_simulated_name as is_simulated_name
    from robolink.model._controller import require_acceleration as require_acceleration
    from robolink.model._controller import says_it_is_simulated as says_it_is_simulated
    from robolink.model._documents import from_json as from_json
    from robolink.model._documents import to_json as to_json
    from robolink.model._geometry import Elbow as Elbow
    from robolink.model._geometry import Hand as Hand
    from robolink.model._geometry import Pose as Pose
    from robolink.model._geometry import Posture as Posture
    from robolink.model._geometry import Wrist as Wrist
    from robolink.model._geometry import angle_difference_deg as angle_difference_deg
    from robolink.model._geometry import describe_pose as describe_pose
    from robolink.model._geometry import rotate_xy as rotate_xy
    from robolink.model._identity import ControllerFacts as ControllerFacts
    from robolink.model._identity import Identity as Identity
    from robolink.model._identity import Secret as Secret
    from robolink.model._identity import Who as Who
    from robolink.model._identity import is_own_name as is_own_name
    from robolink.model._journal_entries import NO_HISTORY as NO_HISTORY
    from robolink.model._journal_entries import PROOFS as PROOFS
    from robolink.model._journal_entries import AnsweredBy as AnsweredBy
    from robolink.model._journal_entries import EntryKind as EntryKind
    from robolink.model._journal_entries import NewCheck as NewCheck
    from robolink.model._journal_entries import NewEntry as NewEntry
    from robolink.model._journal_entries import Recorded as Recorded
    from robolink.model._journal_entries import RecordedCheck as RecordedCheck
    from robolink.model._journal_entries import Signature as Signature
    from robolink.model._journal_entries import answer_entry as answer_entry
    from robolink.model._journal_entries import answered_by_in_words as answered_by_in_words
    from robolink.model._journal_entries import finding_named_now as finding_named_now
    from robolink.model._journal_entries import method_name_now as method_name_now
    from robolink.model._journal_entries import with_method_name_now as with_method_name_now
    from robolink.model._json_values import from_fields as from_fields
    from robolink.model._json_values import json_fields as json_fields
    from robolink.model._json_values import json_value as json_value
    from robolink.model._kinematics import AxisKind as AxisKind
    from robolink.model._kinematics import AxisPositions as AxisPositions
    from robolink.model._kinematics import CsTool as CsTool
    from robolink.model._kinematics import Direction3 as Direction3
    from robolink.model._kinematics import FlangeFrame as FlangeFrame
    from robolink.model._kinematics import (
        ISMKinematicsWithOrientationImage as ISMKinematicsWithOrientationImage,
    )
    from robolink.model._kinematics import (
        ISMOrientationKinematicsWithOriImage2 as ISMOrientationKinematicsWithOriImage2,
    )
    from robolink.model._kinematics import ISMPositionKinematics2 as ISMPositionKinematics2
    from robolink.model._kinematics import MCKinRefSM3 as MCKinRefSM3
    from robolink.model._kinematics import NotReachable as NotReachable
    from robolink.model._kinematics import OrientationDof as OrientationDof
    from robolink.model._kinematics import OrientationImage as OrientationImage
    from robolink.model._kinematics import OrientationSpace as OrientationSpace
    from robolink.model._kinematics import RotationMatrix as RotationMatrix
    from robolink.model._kinematics import combined_space as combined_space
    from robolink.model._kinematics import is_custom as is_custom
    from robolink.model._kinematics import kinematics_class as kinematics_class
    from robolink.model._kinematics import kinematics_object as kinematics_object
    from robolink.model._ledger import Account as Account
    from robolink.model._ledger import Ledger as Ledger
    from robolink.model._ledger import describe_outcome as describe_outcome
    from robolink.model._ledger import outcome_sentences as outcome_sentences
    from robolink.model._ledger import settling_command as settling_command
    from robolink.model._movement import InputEdge as InputEdge
    from robolink.model._movement import Motion as Motion
    from robolink.model._movement import MotionGroup as MotionGroup
    from robolink.model._movement import MotionOutcome as MotionOutcome
    from robolink.model._movement import MotionProfile as MotionProfile
    from robolink.model._movement import MotionTerms as MotionTerms
    from robolink.model._movement import MotionUntilInput as MotionUntilInput
    from robolink.model._movement import Path as Path
    from robolink.model._movement import WorkBox as WorkBox
    from robolink.model._movement import require_target as require_target
    from robolink.model._outcomes import ClientRun as ClientRun
    from robolink.model._outcomes import Finding as Finding
    from robolink.model._outcomes import Marker as Marker
    from robolink.model._outcomes import MarkerKind as MarkerKind
    from robolink.model._outcomes import OutcomeLog as OutcomeLog
    from robolink.model._outcomes import Resolver as Resolver
    from robolink.model._outcomes import Verdict as Verdict
    from robolink.model._outcomes import begun_in_words as begun_in_words
    from robolink.model._outcomes import new_operation as new_operation
    from robolink.model._status import ControllerState as ControllerState
    from robolink.model._status import ControllerStatus as ControllerStatus
    from robolink.model._tip_sensor import TIP as TIP
    from robolink.model._tip_sensor import ControllerSensor as ControllerSensor
    from robolink.model._tip_sensor import ExplainsMisses as ExplainsMisses
    from robolink.model._tip_sensor import KeepsPictures as KeepsPictures
    from robolink.model._tip_sensor import LookingController as LookingController
    from robolink.model._tip_sensor import LooksAtRest as LooksAtRest
    from robolink.model._tip_sensor import NamesDoubts as NamesDoubts
    from robolink.model._tip_sensor import Spot as Spot
    from robolink.model._tip_sensor import SpotUnit as SpotUnit
    from robolink.model._tip_sensor import StationSensor as StationSensor
    from robolink.model._tip_sensor import TipSensor as TipSensor
    from robolink.model._tip_sensor import sensor_address as sensor_address
    from robolink.model._tools import ANY as ANY
    from robolink.model._tools import COMPONENTS as COMPONENTS
    from robolink.model._tools import Expect as Expect
    from robolink.model._tools import Expected as Expected
    from robolink.model._tools import Jump as Jump
    from robolink.model._tools import KinematicToolTable as KinematicToolTable
    from robolink.model._tools import ToolOffset as ToolOffset
    from robolink.model._tools import ToolReceipt as ToolReceipt
    from robolink.model._tools import ToolTable as ToolTable
    from robolink.model._tools import describe_offset as describe_offset
    from robolink.model._tools import of_no_tool as of_no_tool
    from robolink.model._tools import plain_offset as plain_offset
    from robolink.model._tools import put_right as put_right
    from robolink.model._tools import read_for_verdict as read_for_verdict
    from robolink.model._tools import read_offset as read_offset
    from robolink.model._tools import require_offset as require_offset
    from robolink.model._tools import tool_changed as tool_changed
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_arguments": "checks_arguments misgiven not_of_class",
            "_change_limits": (
                "ChangeGuard ChangeLimits PersonRole refuse_operator require_engineer"
            ),
            "_controller": (
                "ACCELERATION_RANGE_MM_S2 Act AlarmList Capabilities Controller DigitalIo "
                "PointReader Value ValueReceipt ValueT VariableTable are_simulated_facts "
                "is_simulated_name require_acceleration says_it_is_simulated"
            ),
            "_documents": "from_json to_json",
            "_geometry": (
                "Elbow Hand Pose Posture Wrist angle_difference_deg describe_pose rotate_xy"
            ),
            "_identity": "ControllerFacts Identity Secret Who is_own_name",
            "_journal_entries": (
                "AnsweredBy EntryKind NO_HISTORY NewCheck NewEntry PROOFS Recorded "
                "RecordedCheck Signature answer_entry answered_by_in_words finding_named_now "
                "method_name_now with_method_name_now"
            ),
            "_json_values": "from_fields json_fields json_value",
            "_kinematics": (
                "AxisKind AxisPositions CsTool Direction3 FlangeFrame "
                "ISMKinematicsWithOrientationImage "
                "ISMOrientationKinematicsWithOriImage2 ISMPositionKinematics2 "
                "MCKinRefSM3 NotReachable OrientationDof OrientationImage "
                "OrientationSpace RotationMatrix combined_space is_custom "
                "kinematics_class kinematics_object"
            ),
            "_ledger": "Account Ledger describe_outcome outcome_sentences settling_command",
            "_movement": (
                "InputEdge Motion MotionGroup MotionOutcome MotionProfile MotionTerms "
                "MotionUntilInput Path WorkBox require_target"
            ),
            "_outcomes": (
                "ClientRun Finding Marker MarkerKind OutcomeLog Resolver Verdict "
                "begun_in_words new_operation"
            ),
            "_status": "ControllerState ControllerStatus",
            "_tip_sensor": (
                "ControllerSensor ExplainsMisses KeepsPictures LookingController LooksAtRest "
                "NamesDoubts Spot SpotUnit StationSensor TIP TipSensor sensor_address"
            ),
            "_tools": (
                "ANY COMPONENTS Expect Expected Jump KinematicToolTable ToolOffset ToolReceipt "
                "ToolTable describe_offset of_no_tool plain_offset put_right "
                "read_for_verdict read_offset require_offset "
                "tool_changed"
            ),
        },
        old_names(__name__),
    )
