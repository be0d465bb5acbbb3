"""Cell files: ``robolink.toml`` with one ``[cells.NAME]`` table for each controller.

Which files are looked at, and in which order, says :func:`config_files`. The tables are
checked by pydantic, which is imported when the first file is loaded and not before;
:func:`cell_names` does without it.
"""

from robolink.config._cells import Cell as Cell
from robolink.config._cells import cell_names as cell_names
from robolink.config._cells import check_file as check_file
from robolink.config._cells import find_cell as find_cell
from robolink.config._cells import load_cells as load_cells
from robolink.config._files import ConfigFile as ConfigFile
from robolink.config._files import Source as Source
from robolink.config._files import config_files as config_files
from robolink.toml_files import Problem as Problem
