"""Cell files: ``robolink.toml`` with one ``[cells.NAME]`` table for each controller.

Which files are looked at, and in which order, says :func:`config_files`. The tables are
checked by pydantic, which is imported when the first file is loaded and not before;
:func:`cell_names` does without it.
"""

from typing import TYPE_CHECKING

from robolink.lazy_exports import lazy_exports, old_names

if TYPE_CHECKING:
    from robolink.config._cells import USUAL_CHANGE_MM as USUAL_CHANGE_MM
    from robolink.config._cells import Cell as Cell
    from robolink.config._cells import CellFiles as CellFiles
    from robolink.config._cells import CellGlimpse as CellGlimpse
    from robolink.config._cells import cell_names as cell_names
    from robolink.config._cells import check_file as check_file
    from robolink.config._cells import find_cell as find_cell
    from robolink.config._cells import glimpse_of_cell as glimpse_of_cell
    from robolink.config._cells import group_names as group_names
    from robolink.config._cells import load_cell_files as load_cell_files
    from robolink.config._cells import load_cells as load_cells
    from robolink.config._cells import select_cells as select_cells
    from robolink.config._cells import settings_of_file as settings_of_file
    from robolink.config._connecting import connect_cell as connect_cell
    from robolink.config._connecting import require_expected_robot as require_expected_robot
    from robolink.config._files import ConfigFile as ConfigFile
    from robolink.config._files import Source as Source
    from robolink.config._files import config_files as config_files
    from robolink.config._journals import lines_naming_journal as lines_naming_journal
    from robolink.config._journals import use_journals_of as use_journals_of
    from robolink.config._journals import use_journals_of_files as use_journals_of_files
    from robolink.config._new_cells import add_cell as add_cell
    from robolink.config._new_cells import content_with_cell as content_with_cell
    from robolink.config._new_cells import set_cell_key as set_cell_key
    from robolink.config._plant import NamedPlant as NamedPlant
    from robolink.config._plant import named_plant as named_plant
    from robolink.config._reach import Expected as Expected
    from robolink.config._reach import Reach as Reach
    from robolink.config._reach import glance_at_cell as glance_at_cell
    from robolink.config._reach import proof_of_files as proof_of_files
    from robolink.config._reach import reach_cell as reach_cell
    from robolink.config._reach import remember_reach as remember_reach
    from robolink.config._selection import GROUP_MARK as GROUP_MARK
    from robolink.config._selection import names_meant as names_meant
    from robolink.config._settings import CellSettings as CellSettings
else:
    __getattr__, __dir__, __all__ = lazy_exports(
        __name__,
        {
            "_cells": (
                "Cell CellFiles CellGlimpse USUAL_CHANGE_MM cell_names check_file "
                "find_cell glimpse_of_cell group_names load_cell_files "
                "load_cells select_cells settings_of_file"
            ),
            "_connecting": "connect_cell require_expected_robot",
            "_files": "ConfigFile Source config_files",
            "_journals": "lines_naming_journal use_journals_of use_journals_of_files",
            "_new_cells": "add_cell content_with_cell set_cell_key",
            "_plant": "NamedPlant named_plant",
            "_reach": "Expected Reach glance_at_cell proof_of_files reach_cell remember_reach",
            "_selection": "GROUP_MARK names_meant",
            "_settings": "CellSettings",
        },
        old_names(__name__),
    )
