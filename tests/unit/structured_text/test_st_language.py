"""The subset of Structured Text: its meaning, refusals, and the results of two compilers."""

import json

import pytest
from robolink_simulators.structured_text import (
    SourceText,
    StructuredProgram,
    StructuredTextError,
    TextDialect,
)
from robolink_simulators.structured_text.parse import INSTRUCTION_WORDS, RESERVED_WORDS

from tests._rows import each_row
from tests.unit.structured_text._bench import JUDGES, needs_judges, program, result

# The subset of Structured Text: its meaning, and what is refused where.

PAIR = "TYPE PAIR : STRUCT a : UINT; b : LREAL; END_STRUCT; END_TYPE"
ADDER = """
FUNCTION_BLOCK Adder
  VAR_INPUT more : INT; END_VAR
  VAR_OUTPUT last : INT; END_VAR
  VAR_IN_OUT total : INT; END_VAR
  last := total;
  total := total + more;
END_FUNCTION_BLOCK
"""

MEANINGS = [
    ("a := 60000; b := a + a; IF b = 54464 THEN r := 1; END_IF;", "a, b : UINT; r : INT;", 1),
    ("r := -9 / 4 * 10 + -9 MOD 4;", "r : INT;", -21),
    ("a := -100; r := a / 8;", "a, r : SINT;", -12),
    ("w := SHL(WORD#16#8001, 1); r := WORD_TO_UINT(w OR WORD#16#0010);", "w : WORD; r : UINT;", 18),
    ("FOR i := 3 TO 1 BY -1 DO r := r * 10 + i; END_FOR;", "i, r : INT;", 321),
    ("REPEAT r := r + 3; UNTIL r > 7 END_REPEAT;", "r : INT;", 9),
    ("CASE r OF 1: r := 5; 0, 2..4: r := 7; ELSE r := 9; END_CASE;", "r : INT;", 7),
    (
        "m[1, 0] := 4; m[0, 1] := 3; r := m[1, 0] - m[0, 1];",
        "m : ARRAY [0..1, 0..1] OF INT; r : INT;",
        1,
    ),
    ("r := TRUNC(-2.75);", "r : DINT;", -2),
    ("r := LREAL_TO_INT(1.5);", "r : INT;", 2),
    ("r := w[2];", "w : ARRAY [1..3] OF INT := [5, 6, 7]; r : INT;", 6),
    ("IF T#1m30s = T#90s THEN r := 1; END_IF;", "r : INT;", 1),
    ("r := LIMIT(1, 40, 15);", "r : INT;", 15),
]


@each_row(("body", "declared", "wanted"), MEANINGS)
def test_what_a_program_means(body, declared, wanted):
    assert result(body, declared) == wanted


DIFFERING = [
    ("r := (a + b) / 2;", "a, b, r : UINT;", 5, 14),
    ("IF a - b > 3 THEN r := 1; END_IF;", "a, b, r : UINT;", 5, 10),
    ("r := UINT_TO_UDINT(a * b);", "a, b : UINT; r : UDINT;", 5, 6),
    ("r := LREAL_TO_INT(0.5);", "r : INT;", 5, 6),
    ("FOR i := 1 TO 2 DO r := i; END_FOR; r := i;", "i, r : INT;", 5, 42),
]
BEYOND = [
    ("r := 1", "r : INT;", 6, 1),
    ("r := a;", "a : UINT; r : UDINT;", 5, 1),
    ("r := 1;", "r : LREAL;", 5, 1),
    ("r := b;", "r : INT;", 5, 6),
    ("IF r THEN r := 1; END_IF;", "r : INT;", 5, 4),
    ("FOR i := 1 TO 3 DO i := 2; END_FOR;", "i : INT;", 5, 20),
    ("CASE r OF 1: r := 2; 0..3: r := 4; END_CASE;", "r : INT;", 5, 22),
    ("CASE r OF 16#10: r := 2; END_CASE;", "r : INT;", 5, 11),
    ("r := 70000;", "r : UINT;", 5, 1),
    ("EXIT;", "r : INT;", 5, 1),
    ("f(IN := TRUE);", "f : F_TRIG;", 3, 5),
    ("p^ := 1;", "p : INT;", 5, 2),
    ("r := 1;", "r : POINTER TO INT;", 3, 13),
    ("r := 1;", "limit, r : INT;", 3, 1),
    ("r := 1; // one", "r : INT;", 5, 9),
    ("w[4] := 1;", "w : ARRAY [0..3] OF INT;", 5, 2),
    ("{region}", "r : INT;", 5, 1),
    ("t(PT := T#1s, PT := T#2s);", "t : TON;", 5, 15),
    ("s := t;", "s, t : TON;", 5, 1),
    ("CASE r OF 1, 2, 3, 4, 5: r := 2; END_CASE;", "r : INT;", 5, 11),
    ("CASE r OF 1..2, 3..4, 5: r := 2; END_CASE;", "r : INT;", 5, 11),
]


@each_row(("body", "declared", "line", "column"), [*DIFFERING, *BEYOND])
def test_what_is_refused_and_where(body, declared, line, column):
    with pytest.raises(StructuredTextError) as refusal:
        result(body, declared)
    place = refusal.value.place
    assert (place.file, place.line, place.column) == ("main.st", line, column), refusal.value


def test_a_refusal_says_what_was_expected():
    with pytest.raises(StructuredTextError, match=r"expected: .*THEN"):
        result("IF r = 1 r := 2; END_IF;")


@each_row(
    "body",
    [
        "r := 1 / r;",
        "WHILE TRUE DO r := r + 1; END_WHILE;",
        "FOR i := 1 TO 200001 DO r := i; END_FOR;",
        "r := w[r - 1];",
        "r := TRUNC(1.0E30);",
    ],
)
def test_what_would_trap_is_refused_when_it_runs(body):
    declared = "r, i : DINT; w : ARRAY [0..3] OF DINT;"
    made = program(body, declared)
    with pytest.raises(StructuredTextError, match=r"line 5"):
        made.cycle(0)


def test_an_instance_keeps_its_variables_and_changes_what_it_is_handed():
    made = program(
        "summing(more := 2, total := r, last => seen); summing(total := r);",
        "r, seen : INT; summing : Adder;",
        ADDER,
    )
    for _ in range(3):
        made.cycle(0)
    assert (made.value("r"), made.value("seen"), made.value("summing.last")) == (12, 8, 10)


def test_structures_are_copied_and_handed_in_by_reference():
    block = """
    FUNCTION_BLOCK Mark
      VAR_IN_OUT one : PAIR; END_VAR
      one.a := one.a + 1;
    END_FUNCTION_BLOCK
    """
    made = program(
        "table[2].b := 1.5; other := table[2]; mark(one := table[2]); r := table[2].a - other.a;",
        "table : ARRAY [1..3] OF PAIR; other : PAIR; mark : Mark; r : UINT;",
        PAIR + block,
    )
    made.cycle(0)
    assert (made.value("r"), made.value("other")) == (1, [0, 1.5])


def test_a_pin_by_reference_must_be_connected():
    with pytest.raises(StructuredTextError, match="total must be connected"):
        program("summing(more := 2);", "summing : Adder;", ADDER)


def test_what_is_retained_outlives_a_restart_and_fits_json():
    text = f"""{PAIR}
    PROGRAM Main
      VAR lost : INT; END_VAR
      VAR RETAIN kept : ARRAY [1..2] OF PAIR; END_VAR
      lost := lost + 1;
      kept[2].a := kept[2].a + 1;
    END_PROGRAM
    """
    made = StructuredProgram([SourceText("main.st", text)], "Main")
    made.cycle(0)
    made.restart()
    made.cycle(0)
    assert (made.value("lost"), made.value("kept")[1]) == (1, [2, 0.0])
    state = json.loads(json.dumps(made.retained()))
    fresh = StructuredProgram([SourceText("main.st", text)], "Main")
    fresh.restore(state)
    assert fresh.value("kept") == [[0, 0.0], [2, 0.0]]


def test_the_glue_may_hold_what_the_common_subset_does_not():
    lists = "{attribute 'qualified_only'} // kept by name\nVAR_GLOBAL RETAIN\n n : UINT;\nEND_VAR\n"
    main = """
    PROGRAM Main
      VAR words AT %IW0 : ARRAY [0..1] OF WORD; delays : ARRAY [0..1] OF TON; END_VAR
      Kept.n := WORD_TO_UINT(words[1]);
      delays[1](IN := TRUE, PT := T#10ms);
    END_PROGRAM
    """
    sources = [
        SourceText("Kept.st", lists, TextDialect.CODESYS),
        SourceText("Main.st", main, TextDialect.CODESYS),
    ]
    made = StructuredProgram(sources, "Main")
    made.put("words", [0, 77])
    made.cycle(0)
    made.cycle(11_000)
    assert made.value("kept.n") == made.retained()["n"] == 77
    assert made.value("delays")[1][2] is True
    with pytest.raises(StructuredTextError, match="glue only"):
        StructuredProgram([SourceText("Main.st", main)], "Main")


NUMBERS = """
TYPE Numbers : STRUCT
  first : DINT;
  rest : ARRAY [0..1] OF DINT;
  second : DINT := 7;
END_STRUCT;
END_TYPE
"""


def begun(list_text, dialect=TextDialect.CODESYS):
    main = "PROGRAM Main\n VAR n : DINT; END_VAR\n n := Kept.numbers.first;\nEND_PROGRAM\n"
    sources = [
        SourceText("Types.st", NUMBERS, TextDialect.CODESYS),
        SourceText("Kept.st", f"VAR_GLOBAL\n {list_text};\nEND_VAR\n", dialect),
        SourceText("Main.st", main, TextDialect.CODESYS),
    ]
    made = StructuredProgram(sources, "Main")
    made.cycle(0)
    return made


def test_members_of_a_structure_may_begin_with_values_in_the_glue():
    made = begun("numbers : Numbers := (first := -3)")
    assert made.value("n") == -3
    assert made.value("Kept.numbers") == [-3, [0, 0], 7]
    assert begun("numbers : Numbers").value("Kept.numbers") == [0, [0, 0], 7]


@each_row(
    ("text", "words"),
    [
        ("numbers : Numbers := (third := 1)", "no member third"),
        ("numbers : Numbers := (first := 2.5)", "Kept.st"),
        ("numbers : Numbers := (first := 1 + other)", "Kept.st"),
        ("other : DINT := (first := 1)", "only a structure"),
    ],
)
def test_first_values_that_fit_no_member_are_refused(text, words):
    with pytest.raises(StructuredTextError, match=words):
        begun(text)


def test_members_do_not_begin_with_values_in_the_common_subset():
    text = f"""{NUMBERS}
    FUNCTION_BLOCK Main
      VAR numbers : Numbers := (first := 1); END_VAR
      numbers.second := 1;
    END_FUNCTION_BLOCK
    """
    with pytest.raises(StructuredTextError, match="glue only"):
        StructuredProgram([SourceText("main.st", text)], "Main")


# Names that CODESYS, TwinCAT or IEC 61131-3 reserve (docs/reference/structured_text.md 1.1).

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


@each_row("dialect", list(TextDialect))
@each_row("where", DECLARED)
@each_row("name", ["bit", "BIT", "Real", "ltime", "adr", "Limit", "int_to_word"])
def test_no_name_is_a_keyword_or_a_type_of_codesys(name, where, dialect):
    error = refusal_of(DECLARED[where].format(name=name), dialect)
    assert f"{name} is a keyword or data type of CODESYS" in str(error)
    assert (error.place.file, error.place.line) == ("mine.st", LINE)


@each_row("name", ["to_word", "a__b", "DWORD_TO_DINT", "atan2", "xsizeof", "class"])
def test_conversions_operators_and_two_underscores_are_no_names(name):
    for dialect in TextDialect:
        error = refusal_of(DECLARED["variable"].format(name=name), dialect)
        assert name.lower() in str(error).lower()
        assert error.place.line == LINE


@each_row("name", ["en", "Ton", "len", "priority", "Single", "ends_"])
def test_what_the_standard_alone_reserves_is_refused_in_the_common_subset(name):
    text = DECLARED["variable"].format(name=name)
    assert f"not every compiler takes the name {name}" in str(refusal_of(text, COMMON))
    StructuredProgram([SourceText("mine.st", text, CODESYS)], "Main")


@each_row("name", ["bits", "beat", "to_do", "words_to_lreal", "bit_", "inbit", "r"])
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


# The interpreter gives the answers of two foreign compilers, and refuses where they differ.


def as_value(of, written):
    if of == "LREAL":
        return float.fromhex(written)
    return bool(written) if of == "BOOL" else written


def answer(case):
    declared = [f"r : {case['result']};"]
    declared += [f"{name} : {of.replace('ARRAY', 'ARRAY ')};" for name, (of, *_) in variables(case)]
    made = program(case.get("body") or f"r := {case['expr']};", "\n".join(declared))
    for name, (of, *first) in variables(case):
        if first:
            made.put(name, as_value(of, *first))
    made.cycle(0)
    return made.value("r")


def variables(case):
    return case["vars"].items()


@needs_judges
def test_every_case_has_the_answer_of_both_or_is_refused():
    cases = json.loads((JUDGES / "semantics.json").read_text())["cases"]
    wrong, refused = [], 0
    for case in cases:
        try:
            got = answer(case)
        except StructuredTextError:
            got = None
            refused += 1
        wanted = as_value(case["result"], case["value"]) if "value" in case else None
        if (type(got), got) != (type(wanted), wanted):
            wrong.append((case, got))
    assert wrong == []
    assert (len(cases), refused) == (259, 14)


def replayed(rows):
    source = SourceText("core.st", (JUDGES / "example" / "core.st").read_text())
    made = StructuredProgram([source], "Main")
    wrong = []
    for row, (ms, permit, inbox, outbox) in enumerate(rows):
        made.put("permit", bool(permit))
        made.put("inbox", [int(inbox[at : at + 4], 16) for at in range(0, 64, 4)])
        made.cycle(ms * 1000)
        if "".join(f"{word:04x}" for word in made.value("outbox")) != outbox:
            wrong.append(row)
    return wrong


def core_rows():
    return json.loads((JUDGES / "example" / "core_trace.json").read_text())["rows"]


@needs_judges
def test_the_worked_example_gives_the_recorded_words():
    assert replayed(core_rows()[:150]) == []


@needs_judges
@pytest.mark.soak
def test_the_worked_example_gives_every_recorded_word():
    assert len(core_rows()) == 1000
    assert replayed(core_rows()) == []


def timers(text):
    return StructuredProgram([SourceText("timers.st", text)], "Main")


@needs_judges
def test_timers_and_counters_run_as_recorded_and_those_that_differ_are_refused():
    text = (JUDGES / "example" / "timers.st").read_text()
    with pytest.raises(StructuredTextError, match=r"timers\.st, line 13, .* F_TRIG"):
        timers(text)
    agreed = [line for line in text.splitlines() if "fFall" not in line and "fDown" not in line]
    made = timers("\n".join(agreed))
    trace = json.loads((JUDGES / "example" / "timers_trace.json").read_text())
    for ms, inp, clear, outputs, _ in trace["rows"]:
        made.put("inp", bool(inp))
        made.put("clear", bool(clear))
        made.cycle(ms * 1000)
        got = [*map(int, made.value("outs")), made.value("cntUp"), 0]
        named = zip(trace["outputs"], got, outputs, strict=True)
        assert [row for row in named if row[1] != row[2] and not differs(row[0])] == [], ms


def differs(name):
    return name.startswith(("f_trig", "ctd"))
