"""The nozzle change: measure the new tip, write its offset, prove it, or undo it."""

from robolink.nozzle_change._change import NozzleChange as NozzleChange
from robolink.nozzle_change._plan import ChangePlan as ChangePlan
from robolink.nozzle_change._plan import ChangeReport as ChangeReport
from robolink.nozzle_change._plan import Proposal as Proposal
from robolink.nozzle_change._preview import PlannedStep as PlannedStep
from robolink.nozzle_change._preview import flange_pose as flange_pose
from robolink.nozzle_change._preview import preview as preview
