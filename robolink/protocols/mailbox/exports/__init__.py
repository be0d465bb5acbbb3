"""What is generated from the mailbox's schema: register map, data sheet, Structured Text."""

from robolink.protocols.mailbox.exports.eds import electronic_data_sheet
from robolink.protocols.mailbox.exports.plc_program import (
    PROGRAM_FILES,
    SYMBOL_LIST,
    PlcopenSchema,
    plcopen_xml,
    program_texts,
    structured_text_types,
)
from robolink.protocols.mailbox.exports.register_map import (
    error_table_csv,
    register_map_csv,
    register_map_markdown,
)

__all__ = [
    "PROGRAM_FILES",
    "PlcopenSchema",
    "SYMBOL_LIST",
    "electronic_data_sheet",
    "error_table_csv",
    "plcopen_xml",
    "program_texts",
    "register_map_csv",
    "register_map_markdown",
    "structured_text_types",
]
