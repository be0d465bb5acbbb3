"""The accuracy of a cell: rows stated in its file, recorded, shown and measured.

Each row of a budget (``robolink.calibration.ACCURACY_ROWS``) is stated by the recipe or the
cell file, learnt from the journal, or a default. docs/accuracy.md explains all three.
"""

from robolink.accuracy._cell_rows import (
    CellRecord,
    KnownRow,
    Recall,
    facts_at,
    rows_at,
    rows_of_station,
    stated_rows,
)
from robolink.accuracy._overview import (
    RowsAt,
    learning_commands,
    measuring_step,
    mm_per_px,
    rows_of_cell,
)
from robolink.accuracy._repeats import learnt_rows, months_at
from robolink.accuracy._row_measurements import (
    LEAST_RECORDS,
    ArtefactTest,
    LooksAlike,
    MeasuredRow,
    RowBound,
    artefact_test,
    measured_entry,
    measured_row,
    paired_half_width,
    pooled_look,
    scatter_of_repeats,
    upper_half_width,
)
from robolink.accuracy._studies import (
    MeasuredTip,
    artefact_row,
    measured_tips,
    study_row,
    tip_image_row,
    turned_pairs,
)

__all__ = [
    "ArtefactTest",
    "CellRecord",
    "KnownRow",
    "LEAST_RECORDS",
    "LooksAlike",
    "MeasuredRow",
    "MeasuredTip",
    "Recall",
    "RowBound",
    "RowsAt",
    "artefact_row",
    "artefact_test",
    "facts_at",
    "learning_commands",
    "learnt_rows",
    "measured_entry",
    "measured_row",
    "measured_tips",
    "measuring_step",
    "mm_per_px",
    "months_at",
    "paired_half_width",
    "pooled_look",
    "rows_at",
    "rows_of_cell",
    "rows_of_station",
    "scatter_of_repeats",
    "stated_rows",
    "study_row",
    "tip_image_row",
    "turned_pairs",
    "upper_half_width",
]
