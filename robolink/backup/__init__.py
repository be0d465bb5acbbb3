"""Backups of a controller's tools: taken, kept as a file, compared, restored."""

from robolink.backup._comparison import Comparison as Comparison
from robolink.backup._comparison import ComparisonTolerance as ComparisonTolerance
from robolink.backup._comparison import ComponentComparison as ComponentComparison
from robolink.backup._comparison import ToolComparison as ToolComparison
from robolink.backup._comparison import compare as compare
from robolink.backup._file import SCHEMA as SCHEMA
from robolink.backup._file import backup_from_text as backup_from_text
from robolink.backup._file import backup_to_text as backup_to_text
from robolink.backup._file import load as load
from robolink.backup._file import save as save
from robolink.backup._first import first_backup_path as first_backup_path
from robolink.backup._first import keep_first_backup as keep_first_backup
from robolink.backup._first import kept_backup as kept_backup
from robolink.backup._restore import RestoreChange as RestoreChange
from robolink.backup._restore import RestorePlan as RestorePlan
from robolink.backup._restore import plan_restore as plan_restore
from robolink.backup._restore import require_same_controller as require_same_controller
from robolink.backup._restore import restore as restore
from robolink.backup._values import TOOLS as TOOLS
from robolink.backup._values import Backup as Backup
from robolink.backup._values import ToolHolder as ToolHolder
from robolink.backup._values import ToolState as ToolState
from robolink.backup._values import read_tools as read_tools
from robolink.backup._values import take_backup as take_backup
