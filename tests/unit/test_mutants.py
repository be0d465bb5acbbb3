"""Which small defects ``python -m tests.mutants`` puts into a module, and which it leaves out."""

from textwrap import dedent

import pytest

from tests.mutants.changes import Kind, mutants_of
from tests.mutants.places import drawn


def changes(text, kind):
    """Return the changes of one kind in a module of some lines."""
    found = mutants_of("module.py", dedent(text).encode())
    return [one.change for one in found if one.kind is kind]


@pytest.mark.parametrize(
    ("kind", "body", "expected"),
    [
        (Kind.COMPARISON, "return a < b <= c", ["a < b => a <= b", "b <= c => b < c"]),
        (Kind.COMPARISON, "return a is not b", ["a is not b => a is b"]),
        (Kind.COMPARISON, "return a not in b", ["a not in b => a in b"]),
        (Kind.CONSTANT, "return 2", ["2 => 3"]),
        (Kind.CONSTANT, "return True", ["True => False"]),
        (Kind.CONSTANT, "return 0.5", ["0.5 => 0.75"]),
        (Kind.ORDER, "return a - b", ["a - b => (b) - (a)"]),
        (Kind.ORDER, "g(a.x_mm, b.y_mm)", ["a.x_mm, b.y_mm => b.y_mm, a.x_mm"]),
        (Kind.ORDER, "mark(); send()", ["mark(); send() => send(); mark()"]),
        (Kind.ORDER, "b = g(a); h(b)", []),
        (Kind.NEGATION, "return 1 if a else 2", ["a => (not (a))"]),
        (Kind.NEGATION, "return not a", ["not a => (a)"]),
        (Kind.NEGATION, "return a and b", ["a and b => a or b"]),
        (Kind.NEGATION, "return 1 if a == b else 2", []),
        (Kind.CALL, "g(a)", ["g(a) => pass"]),
        (Kind.CALL, "return abs(a)", ["abs(a) => (a)"]),
        (Kind.CALL, "\n    with lock: return a", ["with lock => if True"]),
    ],
)
def test_a_line_is_changed_as_a_tired_person_would(kind, body, expected):
    assert changes(f"def f(a, b, c): {body}", kind) == expected


@pytest.mark.parametrize(
    "text",
    [
        '"""What it is."""',
        "def f(): return tr('Press {count} keys.', 'a')",
        "x: Annotated[int, Ge(0)]",
        "@dataclass(frozen=True)\nclass A: pass",
        "def __repr__(self): return g(1 < 2)",
        "if TYPE_CHECKING: g(1)",
        "__all__ = [1]",
    ],
)
def test_what_says_nothing_to_a_machine_is_left_out(text):
    assert mutants_of("module.py", text.encode()) == []


def test_a_mutant_is_the_module_with_one_change():
    source = "def f(a):\n    # ä\n    return 'ö', a < 1, a < 1\n".encode()
    first, second = [one for one in mutants_of("module.py", source) if one.kind is Kind.COMPARISON]
    assert first.applied(source) == source.replace(b"a < 1, a", b"a <= 1, a")
    assert second.applied(source) == source.replace(b"a < 1\n", b"a <= 1\n")
    assert (first.line, first.where, second.name) == (3, "f", "module.py f: a < 1 => a <= 1 #2")


def test_a_draw_is_a_sample_that_a_line_elsewhere_does_not_change(tmp_path):
    package = tmp_path / "robolink"
    package.mkdir()
    (package / "a.py").write_text("".join(f"def f{n}(a): return a < {n}\n" for n in range(40)))
    before = [one.name for one in drawn(tmp_path, seed=1, count=20)]
    (package / "b.py").write_text("def g(a): return a\n")
    assert [one.name for one in drawn(tmp_path, seed=1, count=20)] == before
    assert [one.name for one in drawn(tmp_path, seed=1, count=10)] == before[:10]
    assert [one.name for one in drawn(tmp_path, seed=2, count=20)] != before
