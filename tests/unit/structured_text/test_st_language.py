"""The subset of Structured Text: what it means, what is refused, and where."""

import json

import pytest
from robolink_simulators.structured_text import (
    SourceText,
    StructuredProgram,
    StructuredTextError,
    TextDialect,
)

from tests.unit.structured_text._bench import program, result

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


@pytest.mark.parametrize(("body", "declared", "wanted"), MEANINGS)
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


@pytest.mark.parametrize(("body", "declared", "line", "column"), [*DIFFERING, *BEYOND])
def test_what_is_refused_and_where(body, declared, line, column):
    with pytest.raises(StructuredTextError) as refusal:
        result(body, declared)
    place = refusal.value.place
    assert (place.file, place.line, place.column) == ("main.st", line, column), refusal.value


def test_a_refusal_says_what_was_expected():
    with pytest.raises(StructuredTextError, match=r"expected: .*THEN"):
        result("IF r = 1 r := 2; END_IF;")


@pytest.mark.parametrize(
    "body",
    [
        "r := 1 / r;",
        "WHILE TRUE DO r := r + 1; END_WHILE;",
        "r := w[r - 1];",
        "r := TRUNC(1.0E30);",
    ],
)
def test_what_would_trap_is_refused_when_it_runs(body):
    declared = "r : DINT; w : ARRAY [0..3] OF DINT;"
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


@pytest.mark.parametrize(
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
