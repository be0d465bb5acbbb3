"""Whole programs: functions, types, blocks. Pages are those of the language reference."""

import pytest

LOOP = "Function main\n{}\nFend\n"


def test_a_loop_leaves_its_variable_past_the_limit(printed):
    """Check 29: p. 345."""
    assert printed("Integer i", "For i = 0 To 3", "Next", "Print i") == ["4"]


@pytest.mark.parametrize(("test", "passes"), [("top", "0"), ("bottom", "1")])
def test_whether_a_loop_past_its_end_makes_a_pass_is_an_option(printed, test, passes):
    """Part 4.3, open."""
    lines = ("Integer i, n", "For i = 5 To 3", "n = n + 1", "Next i", "Print n")
    assert printed(*lines, for_test=test) == [passes]


def test_a_loop_counts_down_and_by_fractions(printed):
    """P. 344, 557."""
    lines = ("Real r", "Integer n", "For r = 1 To 0 Step -0.25", "n = n + 1", "Next r")
    assert printed(*lines, "Print n, r") == ["5 -0.25"]


@pytest.mark.parametrize(
    "loop",
    [
        ("Do", "x = x + 1", "Loop Until x = 3"),
        ("Do While x < 3", "x = x + 1", "Loop"),
        ("Do Until (x = 3)", "x = x + 1", "Loop"),
        ("Do", "x = x + 1", "If x = 3 Then Exit Do", "Loop"),
        ("Do", "x = x + 1", "Loop While x < 3"),
    ],
)
def test_every_kind_of_do_makes_three_passes(printed, loop):
    """Check 30: p. 289."""
    assert printed("Integer x", *loop, "Print x") == ["3"]


@pytest.mark.parametrize(("value", "shown"), [("3", ["three", "After"]), ("4", ["other", "After"])])
def test_select_runs_one_case_and_does_not_fall_through(printed, value, shown):
    """Check 31: p. 714."""
    lines = (f"Select {value}", "Case 3", 'Print "three"', "Case 3", 'Print "again"')
    end = ("Default", 'Print "other"', "Send", 'Print "After"')
    assert printed(*lines, *end) == shown


def test_select_takes_texts_conditions_and_comparisons(printed):
    """P. 794, 853; ``Case < 1`` is in a public program."""
    lines = ("String s$", 's$ = "b"', "Select s$", 'Case "a"', "Print 1", 'Case "b"', "Print 2")
    more = ("Send", "Select True", 'Case s$ = "b"', "Print 3", "Send")
    less = ("Select 0", "Case < 1", "Print 4", "Send")
    assert printed(*lines, *more, *less) == ["2", "3", "4"]


def test_a_statement_may_follow_a_case_without_a_semicolon(printed):
    """A public program has four such lines, such as ``Case 1 MemOn 3; Wait MemSw(3)``."""
    lines = ("Select 1", "Case 1 MemOn 3; Print MemSw(3)", "Case 2 MemOff 3", "Send")
    signed = ("Select 0", 'Case < 1 Print "under"', "Send")
    assert printed(*lines, *signed) == ["1", "under"]


@pytest.mark.parametrize(
    "line", ["Case 1 2", "Case MemOn 3", "Case 1 Send", "Case 1 MemOn 3 MemOn 4"]
)
def test_a_case_with_anything_else_behind_it_is_refused(faults, line):
    """Only a statement may follow, and only one without a semicolon."""
    (fault,) = faults("\n".join(["Function main", "Select 1", line, "Send", "Fend"]))
    assert "main.prg:3" in fault


def test_branches_stand_in_blocks_and_on_lines(printed):
    """P. 419; ambiguity 5: Else on a line belongs to the nearest If."""
    lines = (
        "Integer a",
        "If a = 1 Then",
        "Print 1",
        "ElseIf a = 0 Then",
        "Print 2",
        "Else",
        "Print 3",
        "EndIf",
        "If a = 0 Then If a = 1 Then Print 4 Else Print 5; Print 6",
        "If a = 9 Then Print 7; Print 8",
        "If a = 0 Then ' a comment is no statement",
        "Print 9",
        "EndIf",
    )
    assert printed(*lines) == ["2", "5", "6", "9"]


def test_by_reference_needs_the_word_on_both_sides(cell):
    """Check 37: p. 184, 347."""
    shown = cell(
        "Function main\nInteger x\nx = 4\nf(ByRef x)\nPrint x\nf x\nPrint x\nFend\n"
        "Function f(ByRef v As Integer)\nv = v + 1\nFend\n"
    ).run()
    assert shown == ["5", "5"]


def test_arrays_and_their_elements_are_given_by_reference(cell):
    shown = cell(
        "Function main\nInteger a(2), i\ni = 1\nfill(ByRef a())\none(ByRef a(i))\n"
        "Print a(0), a(1), a(2)\nFend\n"
        "Function fill(ByRef b() As Integer)\nInteger k\nFor k = 0 To UBound(b)\nb(k) = k * 10\n"
        "Next\nFend\nFunction one(ByRef v As Integer)\nv = v + 1\nFend\n"
    ).run()
    assert shown == ["0 11 20"]


def test_a_function_is_called_in_every_way_that_programs_write(cell):
    """P. 184; public programs have bare names, and read their own results."""
    shown = cell(
        "Function main\nCall say(1)\nsay(2)\nsay 3\nPrint twice(twice(3)) + seven\n"
        "If twice(2) = 4 Then Print fact(5)\nFend\n"
        "Function say(n As Integer)\nPrint n\nFend\n"
        "Function twice(n As Integer) As Integer\ntwice = n\ntwice = twice + n\nFend\n"
        "Function seven As Integer\nseven = 7\nFend\n"
        "Function fact(n As Long) As Long\nIf n < 2 Then\nfact = 1\nElse\nfact = n * fact(n - 1)\n"
        "EndIf\nFend\n"
    ).run()
    assert shown == ["1", "2", "3", "19", "120"]


def test_a_condition_calls_its_function_at_each_pass(cell):
    shown = cell(
        "Integer n\nFunction main\nDo While more()\nPrint n\nLoop\nFend\n"
        "Function more() As Boolean\nWait 0.1\nn = n + 1\nmore = n < 3\nFend\n"
    ).run()
    assert shown == ["1", "2"]


@pytest.mark.parametrize(
    ("kind", "given", "held"),
    [
        ("UByte", "&H0581 / &H0100", "5"),
        ("UShort", "7 / 2", "3"),
        ("Byte", "-128", "-128"),
        ("UInt32", "&HFFFFFFFF", "4294967295"),
        ("UInt64", "&HFFFFFFFFFFFFFFFF", "18446744073709551615"),
        ("Int32", "((&HFFFFFFFE Xor &HFFFFFFFF) + 1) * -1", "-2"),
        ("Real", "1 / 3", "0.3333333"),
        ("Double", "1 / 3", "0.33333333333333"),
        ("Boolean", "5", "-1"),
        ("Integer", "-1.9", "-1"),
        ("Long", "2147483647", "2147483647"),
    ],
)
def test_a_variable_holds_what_its_type_can(printed, kind, given, held):
    """Part 2, 2.1: a fraction is cut, as EPSON's own library needs it."""
    assert printed(f"{kind} v", f"v = {given}", "Print v") == [held]


@pytest.mark.parametrize(
    ("kind", "given"), [("Byte", 128), ("UByte", -1), ("Integer", 32768), ("UInt32", -1)]
)
def test_a_number_that_does_not_fit_is_an_error_or_begins_again(failure, printed, kind, given):
    """Part 2.1, open."""
    assert failure(f"{kind} v", f"v = {given}").line == 3
    wrapped = printed(f"{kind} v", f"v = {given}", "Print v", integer_overflow="wrap")
    assert wrapped == [
        {128: "-128", 32768: "-32768", -1: "255"}[given] if kind != "UInt32" else "4294967295"
    ]


def test_scopes_are_local_module_and_global(cell):
    """P. 167, 351."""
    made = cell(
        "Global Integer g\nInteger m\nFunction main\nInteger m\nm = 1\ng = 2\nother\nPrint m, g\n"
        "more\nFend\nFunction other\nPrint m, g\nm = 7\ng = g + 1\nFend\n",
        files={"two.prg": "Static Integer m\nFunction more\nPrint m, g\nFend\n"},
    )
    assert made.run() == ["0 2", "1 3", "0 3"]


def test_a_file_that_is_included_twice_means_the_variables_of_each_place(cell):
    made = cell(
        'Integer m\nFunction main\nm = 1\n#include "a.inc"\nother\nFend\n'
        'Function other\nInteger i, m\nm = 5\n#include "a.inc"\nFend\n',
        files={"a.inc": "Print m + 1\n"},
    )
    assert made.run() == ["2", "6"]


@pytest.mark.parametrize(("option", "second"), [("cleared", "1 2"), ("kept", "2 2")])
def test_globals_keep_or_lose_their_values_at_a_start(cell, option, second):
    """Check 14 of programs: p. 351; Preserve keeps."""
    made = cell(
        "Global Integer g\nGlobal Preserve Integer p\nFunction main\ng = g + 1\np = p + 1\n"
        "Print g, p\nFend\n",
        globals_at_start=option,
    )
    assert made.run() == ["1 1"]
    assert made.run() == [second]


def test_arrays_grow_and_say_how_far_they_go(printed, failure):
    """P. 683, 860."""
    lines = ("Integer a(1), b(1, 2)", "a(1) = 5", "Redim Preserve a(3)", "b(1, 2) = 4")
    shown = printed(*lines, "Print a(1), a(3), UBound(a), UBound(b, 2), b(1, 2)")
    assert shown == ["5 0 3 2 4"]
    assert failure("Integer a(1)", "a(2) = 1").number == 2240


def test_subroutines_return_to_where_they_were_called(printed, failure):
    """P. 357."""
    assert printed("GoSub s", "Print 2", "GoTo e", "s:", "Print 1", "Return", "e:") == ["1", "2"]
    assert failure("Return").number == 2383


def test_directives_choose_and_replace(cell):
    """P. 58 to 63; EPSON's library has a macro with a semicolon (check 19 of programs)."""
    made = cell(
        '#include "d.inc"\n#ifdef LOUD\n#define WORD "loud"\n#else\n#define WORD "quiet"\n#endif\n'
        "Function main\nInteger f\nPrint WORD ' WORD\nIf 0 Then SET(f, 3)\nPrint f\n"
        'SET(f, LAST)\nPrint f, "LAST"\nFend\n',
        files={"d.inc": "#define SET(v, n) v = n; Print v\n#define LAST 9\n#undef LOUD\n"},
    )
    assert made.run() == ["quiet", "0", "9", "9LAST"]


def test_files_come_in_several_code_pages(cell):
    text = '\' \u4f4d\u7f6e\nFunction other\nPrint "\u3042"\nFend\n'
    made = cell("Function main\nother\nFend\n", files={"o.prg": text.encode("cp932")})
    assert made.run() == ["\u3042"]


def test_forms_of_public_programs_are_taken(printed):
    """Part 2 of the page of programs: semicolons at line ends, P00, ``''`` comments."""
    lines = (
        "Integer n, d(8)",
        "n = 0;",
        "d(7) = &H03;",
        "P00 = XY(1, 2, 3, 4)  '' old",
        "n = d(7) /2",
    )
    assert printed(*lines, "Print n, CX(P0)") == ["1 1"]


def test_labels_of_points_take_shifts_and_replacements_wherever_they_stand(printed):
    """Seen in two public programs."""
    lines = (
        "P1 = XY(100, 300, -50, 20)",
        'PLabel 1, "teach"',
        'PLabel 2, "place"',
        "Real h",
        "h = 4",
        "place = teach -Z(h) :U(0)",
        "Print CZ(P2), CU(P2)",
        "P3 = teach -Z(h)",
        "P4 = teach +X(1) -Y(2)",
        "Print CZ(P3), CX(P4), CY(P4)",
        "Print CZ(teach :Z(-7))",
    )
    assert printed(*lines) == ["-54 0", "-54 101 298", "-7"]
    array = ("Integer z(3), a", "a = 5", "z(2) = 3", "Print a - z(2)")
    assert printed(*array) == ["2"]


def test_the_number_of_an_arch_may_be_worked_out(printed, failure):
    lines = (
        "Integer n",
        "n = 3",
        "P1 = Here -X(10)",
        "Jump P1 C(n) LimZ 0",
        "Print Dist(P1, Here) < 0.001",
    )
    assert printed(*lines) == ["-1"]
    assert failure("P1 = Here", "Jump P1 C(8)").number == 2271


@pytest.mark.parametrize(
    "line",
    [
        "WorkQue_Remove 1, All",
        "Print WorkQue_Len(1)",
        "Go WorkQue_Get(1, (0)) :Z(5)",
        "Cnv_Mode 1, 2",
    ],
)
def test_options_of_the_controller_build_and_are_refused_when_they_are_come_to(failure, line):
    told = failure("String a$", "Print 1", line)
    assert (told.number, told.line) == (2199, 4)


def test_one_project_is_read_in_one_code_page(cell):
    """GBK bytes that are also code page 932: the label is the same in both files, or not found."""
    label = "\u5de5\u4f4d"
    told = "\u8bf7\u68c0\u67e5".encode("gbk")
    label.encode("gbk").decode("cp932")
    with pytest.raises(UnicodeDecodeError):
        told.decode("cp932")
    made = cell(
        "Function main\nother\nFend\n",
        files={
            "o.prg": b"' " + told + f"\nFunction other\nPrint CX({label})\nFend\n".encode("gbk"),
            "robot1.pts": (
                'Point1 {\nnNumber=4\nsLabel="' + label + '"\nrX=7\nrY=0\nrZ=0\nrU=0\n}\n'
            ).encode("gbk"),
        },
        points=["robot1.pts"],
    )
    assert made.run() == ["7"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (LOOP.format("Print (1"), "main.prg:2:9: the line ends too early"),
        (LOOP.format("If 1 The"), "main.prg:2:6: this cannot be here: The"),
        (LOOP.format("x = 1"), "main.prg:2: nothing is called x"),
        (LOOP.format("Foo 1"), "there is no statement and no function foo"),
        (LOOP.format("GoTo away"), "error 3108"),
        (LOOP.format("For i = 1 To 2\nNext"), "main.prg:2: nothing is called i"),
        (LOOP.format("Do"), "main.prg:2: this is never closed (expected Loop)"),
        (LOOP.format("Do\nEndIf"), "no open block that this belongs to (expected Loop)"),
        (LOOP.format("Where"), "where is for the command window only"),
        (LOOP.format("Integer a\nInteger A"), "a is declared twice"),
        (LOOP.format("Exit For"), "there is no such loop around it"),
        ("Function main\nPrint 1\n", "this is never closed (expected Fend)"),
        ("Print 1\n", "this cannot be outside functions"),
        ('#include "none.inc"\n', "There is no file none.inc"),
        (LOOP.format("Print f(1)") + "Function f\nFend\n", "f takes 0 arguments"),
        (LOOP.format("Print 1") + "Function MAIN\nFend\n", "there is another function MAIN"),
        (LOOP.format("'" + "x" * 600), "longer than 512"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(faults, text, told):
    found = faults(text, files={"robot1.pts": ""}, points=["robot1.pts"])
    assert any(told in fault for fault in found), found
    assert len(found) <= 2


def test_every_fault_of_a_project_is_told_at_once(faults):
    found = faults(LOOP.format("Print )\nPrint (\nGoTo nowhere"))
    assert [fault.split(":")[1] for fault in found] == ["2", "3", "4"]


def test_undeclared_names_become_variables_where_an_option_says_so(printed):
    """P. 304, 569: samples use them."""
    assert printed("a = 1.5", "Print a * 2", undeclared="double") == ["3"]


def test_an_unknown_statement_is_refused_and_never_passed_over(failure):
    assert failure("Print 1", "VTeach", "Print 2").number == 2199
