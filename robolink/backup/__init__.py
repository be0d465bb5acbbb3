"""Backups of a controller's tools: taken, kept as a file, compared, restored."""

from robolink.backup._comparison import (
    TOOLS,
    Backup,
    Comparison,
    ComparisonTolerance,
    ComponentComparison,
    ToolComparison,
    ToolHolder,
    ToolState,
    compare,
    read_tools,
    take_backup,
)
from robolink.backup._file import (
    SCHEMA,
    backup_from_text,
    backup_to_text,
    first_backup_path,
    keep_first_backup,
    kept_backup,
    load,
    save,
)
from robolink.backup._restore import (
    RestoreChange,
    RestorePlan,
    plan_restore,
    require_same_controller,
    restore,
)

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
