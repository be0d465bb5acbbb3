"""What is generated from the mailbox's schema: register map, data sheet, Structured Text."""

from robolink.protocols.mailbox.exports.eds import electronic_data_sheet
from robolink.protocols.mailbox.exports.error_table import error_table_csv
from robolink.protocols.mailbox.exports.plc_program import PROGRAM_FILES, program_texts
from robolink.protocols.mailbox.exports.plcopen_xml import PlcopenSchema, plcopen_xml
from robolink.protocols.mailbox.exports.register_map import register_map_csv, register_map_markdown
from robolink.protocols.mailbox.exports.structured_text import structured_text_types

__all__ = [
    "PROGRAM_FILES",
    "PlcopenSchema",
    "electronic_data_sheet",
    "error_table_csv",
    "plcopen_xml",
    "program_texts",
    "register_map_csv",
    "register_map_markdown",
    "structured_text_types",
]
