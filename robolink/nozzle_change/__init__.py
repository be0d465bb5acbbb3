"""The nozzle change: measure the new tip, write its offset, prove it, or undo it."""

from robolink.nozzle_change._change import NozzleChange as NozzleChange
from robolink.nozzle_change._from_poses import PosesPlan as PosesPlan
from robolink.nozzle_change._from_poses import PosesProposal as PosesProposal
from robolink.nozzle_change._from_poses import propose_from_poses as propose_from_poses
from robolink.nozzle_change._from_poses import require_plausible as require_plausible
from robolink.nozzle_change._from_poses import write_proposal as write_proposal
from robolink.nozzle_change._plan import ChangePlan as ChangePlan
from robolink.nozzle_change._plan import ChangeReport as ChangeReport
from robolink.nozzle_change._plan import Proposal as Proposal
from robolink.nozzle_change._preview import PlannedStep as PlannedStep
from robolink.nozzle_change._preview import flange_pose as flange_pose
from robolink.nozzle_change._preview import preview as preview
