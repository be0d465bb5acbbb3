"""Backups of a controller's tools: taken, kept as a file, compared, restored."""

from robolink.backup._comparison import (
    Comparison,
    ComparisonTolerance,
    ComponentComparison,
    ToolComparison,
    compare,
)
from robolink.backup._file import SCHEMA, backup_from_text, backup_to_text, load, save
from robolink.backup._first import first_backup_path, keep_first_backup, kept_backup
from robolink.backup._restore import (
    RestoreChange,
    RestorePlan,
    plan_restore,
    require_same_controller,
    restore,
)
from robolink.backup._values import TOOLS, Backup, ToolHolder, ToolState, read_tools, take_backup

__all__ = [
    "Backup",
    "Comparison",
    "ComparisonTolerance",
    "ComponentComparison",
    "RestoreChange",
    "RestorePlan",
    "SCHEMA",
    "TOOLS",
    "ToolComparison",
    "ToolHolder",
    "ToolState",
    "backup_from_text",
    "backup_to_text",
    "compare",
    "first_backup_path",
    "keep_first_backup",
    "kept_backup",
    "load",
    "plan_restore",
    "read_tools",
    "require_same_controller",
    "restore",
    "save",
    "take_backup",
]
