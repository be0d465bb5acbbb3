"""Values and interfaces. No I/O."""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.model._change_limits import ChangeGuard as ChangeGuard
    from robolink.model._change_limits import ChangeLimits as ChangeLimits
    from robolink.model._controller import Act as Act
    from robolink.model._controller import Capabilities as Capabilities
    from robolink.model._controller import Controller as Controller
    from robolink.model._controller_cameras import ControllerSensor as ControllerSensor
    from robolink.model._controller_cameras import LookingController as LookingController
    from robolink.model._identity import ControllerFacts as ControllerFacts
    from robolink.model._identity import Identity as Identity
    from robolink.model._identity import Who as Who
    from robolink.model._identity import is_own_name as is_own_name
    from robolink.model._optional_parts import AlarmList as AlarmList
    from robolink.model._optional_parts import DigitalIo as DigitalIo
    from robolink.model._optional_parts import PointReader as PointReader
    from robolink.model._optional_parts import Value as Value
    from robolink.model._optional_parts import ValueReceipt as ValueReceipt
    from robolink.model._optional_parts import ValueT as ValueT
    from robolink.model._optional_parts import VariableTable as VariableTable
    from robolink.model._people import PersonRole as PersonRole
    from robolink.model._people import refuse_operator as refuse_operator
    from robolink.model._people import require_engineer as require_engineer
    from robolink.model._secret import Secret as Secret
    from robolink.model._simulated import are_simulated_facts as are_simulated_facts
    from robolink.model._simulated import is_simulated_name as is_simulated_name
    from robolink.model._simulated import says_it_is_simulated as says_it_is_simulated
    from robolink.model._status import ControllerState as ControllerState
    from robolink.model._status import ControllerStatus as ControllerStatus
    from robolink.model._tools import ANY as ANY
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
    from robolink.model._tools import tool_changed as tool_changed
    from robolink.model.motion.custom_kinematics import AxisKind as AxisKind
    from robolink.model.motion.custom_kinematics import AxisPositions as AxisPositions
    from robolink.model.motion.custom_kinematics import FlangeFrame as FlangeFrame
    from robolink.model.motion.custom_kinematics import (
        ISMKinematicsWithOrientationImage as ISMKinematicsWithOrientationImage,
    )
    from robolink.model.motion.custom_kinematics import (
        ISMOrientationKinematicsWithOriImage2 as ISMOrientationKinematicsWithOriImage2,
    )
    from robolink.model.motion.custom_kinematics import (
        ISMPositionKinematics2 as ISMPositionKinematics2,
    )
    from robolink.model.motion.custom_kinematics import MCKinRefSM3 as MCKinRefSM3
    from robolink.model.motion.custom_kinematics import is_custom as is_custom
    from robolink.model.motion.custom_kinematics import kinematics_class as kinematics_class
    from robolink.model.motion.custom_kinematics import kinematics_object as kinematics_object
    from robolink.model.motion.geometry import Elbow as Elbow
    from robolink.model.motion.geometry import Hand as Hand
    from robolink.model.motion.geometry import Pose as Pose
    from robolink.model.motion.geometry import Posture as Posture
    from robolink.model.motion.geometry import Wrist as Wrist
    from robolink.model.motion.geometry import angle_difference_deg as angle_difference_deg
    from robolink.model.motion.geometry import describe_pose as describe_pose
    from robolink.model.motion.geometry import rotate_xy as rotate_xy
    from robolink.model.motion.movement import Motion as Motion
    from robolink.model.motion.movement import MotionGroup as MotionGroup
    from robolink.model.motion.movement import MotionOutcome as MotionOutcome
    from robolink.model.motion.movement import MotionProfile as MotionProfile
    from robolink.model.motion.movement import MotionTerms as MotionTerms
    from robolink.model.motion.movement import Path as Path
    from robolink.model.motion.movement import WorkBox as WorkBox
    from robolink.model.motion.orientation_coupling import CsTool as CsTool
    from robolink.model.motion.orientation_coupling import OrientationImage as OrientationImage
    from robolink.model.motion.orientation_coupling import combined_space as combined_space
    from robolink.model.motion.orientation_space import Direction3 as Direction3
    from robolink.model.motion.orientation_space import NotReachable as NotReachable
    from robolink.model.motion.orientation_space import OrientationDof as OrientationDof
    from robolink.model.motion.orientation_space import OrientationSpace as OrientationSpace
    from robolink.model.motion.orientation_space import RotationMatrix as RotationMatrix
    from robolink.model.motion.tip_sensor import TIP as TIP
    from robolink.model.motion.tip_sensor import Spot as Spot
    from robolink.model.motion.tip_sensor import SpotUnit as SpotUnit
    from robolink.model.motion.tip_sensor import TipSensor as TipSensor
    from robolink.model.motion.until_input import InputEdge as InputEdge
    from robolink.model.motion.until_input import MotionUntilInput as MotionUntilInput
    from robolink.model.record.findings import Finding as Finding
    from robolink.model.record.findings import Resolver as Resolver
    from robolink.model.record.findings import Verdict as Verdict
    from robolink.model.record.journal_entries import NO_HISTORY as NO_HISTORY
    from robolink.model.record.journal_entries import PROOFS as PROOFS
    from robolink.model.record.journal_entries import AnsweredBy as AnsweredBy
    from robolink.model.record.journal_entries import EntryKind as EntryKind
    from robolink.model.record.journal_entries import NewEntry as NewEntry
    from robolink.model.record.journal_entries import Recorded as Recorded
    from robolink.model.record.journal_entries import Signature as Signature
    from robolink.model.record.journal_entries import answer_entry as answer_entry
    from robolink.model.record.journal_entries import answered_by_in_words as answered_by_in_words
    from robolink.model.record.ledger import Account as Account
    from robolink.model.record.ledger import Ledger as Ledger
    from robolink.model.record.marker_words import begun_in_words as begun_in_words
    from robolink.model.record.method_names import finding_named_now as finding_named_now
    from robolink.model.record.method_names import method_name_now as method_name_now
    from robolink.model.record.method_names import with_method_name_now as with_method_name_now
    from robolink.model.record.outcomes import ClientRun as ClientRun
    from robolink.model.record.outcomes import Marker as Marker
    from robolink.model.record.outcomes import MarkerKind as MarkerKind
    from robolink.model.record.outcomes import OutcomeLog as OutcomeLog
    from robolink.model.record.outcomes import new_operation as new_operation
    from robolink.model.record.standing_words import describe_standing as describe_standing
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_change_limits": "ChangeGuard ChangeLimits",
            "_controller": "Act Capabilities Controller",
            "_controller_cameras": "ControllerSensor LookingController",
            "_identity": "ControllerFacts Identity Who is_own_name",
            "_optional_parts": (
                "AlarmList DigitalIo PointReader Value ValueReceipt ValueT VariableTable"
            ),
            "_people": "PersonRole refuse_operator require_engineer",
            "_secret": "Secret",
            "_simulated": "are_simulated_facts is_simulated_name says_it_is_simulated",
            "_status": "ControllerState ControllerStatus",
            "_tools": (
                "ANY Expect Expected Jump KinematicToolTable ToolOffset ToolReceipt "
                "ToolTable describe_offset of_no_tool plain_offset put_right "
                "read_for_verdict read_offset "
                "tool_changed"
            ),
            "motion.custom_kinematics": (
                "AxisKind AxisPositions FlangeFrame "
                "ISMKinematicsWithOrientationImage "
                "ISMOrientationKinematicsWithOriImage2 "
                "ISMPositionKinematics2 MCKinRefSM3 is_custom "
                "kinematics_class kinematics_object"
            ),
            "motion.geometry": (
                "Elbow Hand Pose Posture Wrist angle_difference_deg describe_pose rotate_xy"
            ),
            "motion.movement": (
                "Motion MotionGroup MotionOutcome MotionProfile MotionTerms Path WorkBox"
            ),
            "motion.orientation_coupling": "CsTool OrientationImage combined_space",
            "motion.orientation_space": (
                "Direction3 NotReachable OrientationDof OrientationSpace RotationMatrix"
            ),
            "motion.tip_sensor": "Spot SpotUnit TIP TipSensor",
            "motion.until_input": "InputEdge MotionUntilInput",
            "record.findings": "Finding Resolver Verdict",
            "record.journal_entries": (
                "AnsweredBy EntryKind NO_HISTORY NewEntry PROOFS Recorded "
                "Signature answer_entry answered_by_in_words"
            ),
            "record.ledger": "Account Ledger",
            "record.marker_words": "begun_in_words",
            "record.method_names": "finding_named_now method_name_now with_method_name_now",
            "record.outcomes": "ClientRun Marker MarkerKind OutcomeLog new_operation",
            "record.standing_words": "describe_standing",
        },
    )
