"""Tool changes that are done, or were never: all or none, put back once, recoverable."""

from robolink.model import Jump as Jump
from robolink.transaction._change import ToolChange as ToolChange
from robolink.transaction._change import change_tools as change_tools
from robolink.transaction._history import ChangedSince as ChangedSince
from robolink.transaction._history import changed_since as changed_since
from robolink.transaction._history import earlier_corrections as earlier_corrections
from robolink.transaction._history import last_proof as last_proof
from robolink.transaction._orders import LONGEST_ORDER as LONGEST_ORDER
from robolink.transaction._orders import Describe as Describe
from robolink.transaction._orders import DoneOrder as DoneOrder
from robolink.transaction._orders import Order as Order
from robolink.transaction._orders import carrying_out as carrying_out
from robolink.transaction._orders import plain_result as plain_result
from robolink.transaction._orders import require_order_id as require_order_id
from robolink.transaction._put_back import PutBack as PutBack
from robolink.transaction._put_back import Step as Step
from robolink.transaction._recovery import Recovery as Recovery
from robolink.transaction._recovery import look as look
from robolink.transaction._recovery import recover as recover
from robolink.transaction._settling import Settler as Settler
from robolink.transaction._undo import Undone as Undone
from robolink.transaction._undo import UndoPlan as UndoPlan
from robolink.transaction._undo import plan_undo as plan_undo
from robolink.transaction._undo import undo as undo
from robolink.transaction._undo_history import id_of_change as id_of_change
from robolink.transaction._wanted import Wanted as Wanted
