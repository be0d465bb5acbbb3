"""What a cell knows of its own accuracy: stated, on record, shown, measured.

Each row of a budget (``robolink.calibration.ACCURACY_ROWS``) is stated by the recipe or the
cell file, learnt from the journal, or a default. docs/accuracy.md explains all three.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from robolink.accuracy._age import months_at as months_at
    from robolink.accuracy._bounds import LEAST_RECORDS as LEAST_RECORDS
    from robolink.accuracy._bounds import ArtefactTest as ArtefactTest
    from robolink.accuracy._bounds import RowBound as RowBound
    from robolink.accuracy._bounds import artefact_test as artefact_test
    from robolink.accuracy._bounds import paired_half_width as paired_half_width
    from robolink.accuracy._bounds import scatter_of_repeats as scatter_of_repeats
    from robolink.accuracy._bounds import upper_half_width as upper_half_width
    from robolink.accuracy._known import CellRecord as CellRecord
    from robolink.accuracy._known import KnownRow as KnownRow
    from robolink.accuracy._known import Recall as Recall
    from robolink.accuracy._known import facts_at as facts_at
    from robolink.accuracy._known import rows_at as rows_at
    from robolink.accuracy._looks import LooksAlike as LooksAlike
    from robolink.accuracy._looks import pooled_look as pooled_look
    from robolink.accuracy._measured import MeasuredRow as MeasuredRow
    from robolink.accuracy._measured import measured_entry as measured_entry
    from robolink.accuracy._measured import measured_row as measured_row
    from robolink.accuracy._overview import RowsAt as RowsAt
    from robolink.accuracy._overview import mm_per_px as mm_per_px
    from robolink.accuracy._overview import rows_of_cell as rows_of_cell
    from robolink.accuracy._remedies import learning_commands as learning_commands
    from robolink.accuracy._remedies import measuring_step as measuring_step
    from robolink.accuracy._repeats import learnt_rows as learnt_rows
    from robolink.accuracy._stated import rows_of_station as rows_of_station
    from robolink.accuracy._stated import stated_rows as stated_rows
    from robolink.accuracy._studies import MeasuredTip as MeasuredTip
    from robolink.accuracy._studies import artefact_row as artefact_row
    from robolink.accuracy._studies import measured_tips as measured_tips
    from robolink.accuracy._studies import study_row as study_row
    from robolink.accuracy._studies import tip_image_row as tip_image_row
    from robolink.accuracy._studies import turned_pairs as turned_pairs

__getattr__ = lazy_exports(
    __name__,
    {
        "_age": "months_at",
        "_bounds": "ArtefactTest LEAST_RECORDS RowBound artefact_test paired_half_width "
        "scatter_of_repeats upper_half_width",
        "_known": "CellRecord KnownRow Recall facts_at rows_at",
        "_looks": "LooksAlike pooled_look",
        "_measured": "MeasuredRow measured_entry measured_row",
        "_overview": "RowsAt mm_per_px rows_of_cell",
        "_remedies": "learning_commands measuring_step",
        "_repeats": "learnt_rows",
        "_stated": "rows_of_station stated_rows",
        "_studies": "MeasuredTip artefact_row measured_tips study_row tip_image_row turned_pairs",
    },
)
