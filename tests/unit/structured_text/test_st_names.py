"""Names that CODESYS, TwinCAT or IEC 61131-3 keep (docs/reference/structured_text.md 1.1)."""

import pytest
from robolink_simulators.structured_text import SourceText, StructuredProgram, TextDialect
from robolink_simulators.structured_text.parse import (
    INSTRUCTION_WORDS,
    RESERVED_WORDS,
    StructuredTextError,
)

COMMON, CODESYS = TextDialect.COMMON, TextDialect.CODESYS
DECLARED = {
    "variable": "PROGRAM Main\nVAR\n  ok : INT;\n  {name} : WORD;\nEND_VAR\nok := 1;\nEND_PROGRAM",
    "member": "TYPE Pair : STRUCT\n  ok : INT;\n\n  {name} : WORD;\nEND_STRUCT;\nEND_TYPE\n",
    "type": "TYPE Ok : ARRAY [0..1] OF INT; END_TYPE\n\n\nTYPE {name} : Ok; END_TYPE\n",
    "block": "\n\n\nFUNCTION_BLOCK {name}\nVAR\n  ok : INT;\nEND_VAR\nok := 1;\nEND_FUNCTION_BLOCK",
}
LINE = 4


def refusal_of(text, dialect):
    with pytest.raises(StructuredTextError) as refusal:
        StructuredProgram([SourceText("mine.st", text, dialect)], "Main")
    return refusal.value


@pytest.mark.parametrize("dialect", list(TextDialect))
@pytest.mark.parametrize("where", DECLARED)
@pytest.mark.parametrize("name", ["bit", "BIT", "Real", "ltime", "adr", "Limit", "int_to_word"])
def test_no_name_is_a_keyword_or_a_type_of_codesys(name, where, dialect):
    error = refusal_of(DECLARED[where].format(name=name), dialect)
    assert f"{name} is a keyword or data type of CODESYS" in str(error)
    assert (error.place.file, error.place.line) == ("mine.st", LINE)


@pytest.mark.parametrize("name", ["to_word", "a__b", "DWORD_TO_DINT", "atan2", "xsizeof", "class"])
def test_conversions_operators_and_two_underscores_are_no_names(name):
    for dialect in TextDialect:
        error = refusal_of(DECLARED["variable"].format(name=name), dialect)
        assert name.lower() in str(error).lower()
        assert error.place.line == LINE


@pytest.mark.parametrize("name", ["en", "Ton", "len", "priority", "Single", "ends_"])
def test_what_the_standard_alone_reserves_is_refused_in_the_common_subset(name):
    text = DECLARED["variable"].format(name=name)
    assert f"not every compiler takes the name {name}" in str(refusal_of(text, COMMON))
    StructuredProgram([SourceText("mine.st", text, CODESYS)], "Main")


@pytest.mark.parametrize("name", ["bits", "beat", "to_do", "words_to_lreal", "bit_", "inbit", "r"])
def test_a_name_that_only_looks_like_one_is_taken(name):
    text = DECLARED["variable"].format(name=name)
    StructuredProgram([SourceText("mine.st", text, CODESYS)], "Main")


def test_every_word_of_the_list_is_one_word_in_capital_letters():
    assert len(RESERVED_WORDS) > 200
    for word in RESERVED_WORDS:
        assert word == word.upper()
        assert word.replace("_", "").isalnum()


def test_the_common_subset_takes_no_word_of_the_list_in_whatever_case():
    words = RESERVED_WORDS - INSTRUCTION_WORDS
    for word in sorted(words):
        text = DECLARED["variable"].format(name=word.swapcase())
        assert refusal_of(text, COMMON).place.line == LINE


LIST = SourceText("Kept.st", "VAR_GLOBAL RETAIN\n  n : UINT;\nEND_VAR\n", CODESYS)
TYPE = SourceText("types.st", "\nTYPE KEPT : STRUCT\n  n : UINT;\nEND_STRUCT;\nEND_TYPE\n", CODESYS)


@pytest.mark.parametrize(("texts", "line"), [((LIST, TYPE), 2), ((TYPE, LIST), 1)])
def test_a_type_and_a_list_of_global_variables_are_not_of_one_name(texts, line):
    with pytest.raises(StructuredTextError, match=r"(?i)kept appears twice") as refusal:
        StructuredProgram(texts, "Main")
    assert (refusal.value.place.file, refusal.value.place.line) == (texts[1].name, line)
