"""Possible changes of the product's lines: five kinds of small defects.

Each is a typical slip: a comparison without its equal sign or reversed, a constant that is off by
one, two swapped things, a negated condition, a missing call. Text without effect on the program is
left out: docstrings, sentences for people, type annotations, ``__repr__``, version numbers, the
arguments of data classes.
"""

import ast
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from typing import Final


class Kind(StrEnum):
    """The kind of defect in a mutant."""

    COMPARISON = "comparison"
    CONSTANT = "constant"
    ORDER = "order"
    NEGATION = "negation"
    CALL = "missing call"


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one place.

    Attributes:
        file: The module, from the root of the tree.
        where: The function or class that it is in, by its qualified name; empty at module level.
        kind: The kind of defect.
        line: The first changed line.
        last_line: The last changed line.
        statement: First and last line of its statement, without the body.
        called: Whether it runs when a function is called, not when the module is imported.
        begin: The start of the changed text, in bytes of the file.
        end: Its end.
        before: The old text.
        after: The new text.
        nth: Its place among those that are alike in ``file``, ``where`` and change.
    """

    file: str
    where: str
    kind: Kind
    line: int
    last_line: int
    statement: tuple[int, int]
    called: bool
    begin: int
    end: int
    before: str
    after: str
    nth: int = 0

    @property
    def change(self) -> str:
        """The change in one line."""
        return f"{_one_line(self.before)} => {_one_line(self.after)}"

    @property
    def name(self) -> str:
        """Its name, which stays the same when lines above it are added or removed."""
        nth = f" #{self.nth + 1}" if self.nth else ""
        return f"{self.file} {self.where or 'module'}: {self.change}{nth}"

    def applied(self, source: bytes) -> bytes:
        """Return the module's text with this change."""
        return source[: self.begin] + self.after.encode() + source[self.end :]


def _one_line(text: str) -> str:
    return re.sub(r"\s+", " ", text).strip()


def mutants_of(file: str, source: bytes) -> list[Mutant]:
    """Return the mutants of one module.

    Args:
        file: Its path, for the mutants' names.
        source: Its text.

    Example:
        >>> [str(one.change) for one in mutants_of("m.py", b"def f(a, b): return a < b")]
        ['a < b => a <= b']
    """
    finder = _Finder(file, source)
    finder.visit(ast.parse(source))
    counted: Counter[tuple[str, str]] = Counter()
    named = []
    for one in sorted(finder.found, key=lambda one: (one.begin, one.end, one.after)):
        named.append(replace(one, nth=counted[one.where, one.change]))
        counted[one.where, one.change] += 1
    return named


_TURNED: Final[dict[type[ast.cmpop], tuple[str, str]]] = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: (r"is\s+not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: (r"not\s+in", "in"),
}
_ORDERED: Final = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
_SENTENCES: Final = frozenset({"tr", "declared", "spoken", "joined", "TypeVar", "getLogger"})
"""Calls whose arguments are for people, or are names without effect."""

_FOR_PEOPLE: Final = frozenset({"help", "short_help", "epilog", "metavar", "remedy", "strict"})
"""Keywords whose values are for people; and ``strict`` of ``zip``, which only asserts."""

_ALIKE: Final = frozenset(
    [
        "abs",
        "round",
        "sorted",
        "reversed",
        "set",
        "int",
        "ceil",
        "floor",
        "sqrt",
        "radians",
        "degrees",
        "copy",
        "strip",
        "rstrip",
        "lstrip",
        "lower",
        "upper",
        "casefold",
        "resolve",
        "transpose",
        "deepcopy",
        "fsum",
        "escape",
    ]
)
"""Functions and methods that return their argument in another form, so that one can forget them.
Without any other call a value would have another type, which fails at once and shows little.
"""

_TWINS: Final = tuple(
    frozenset(words.split())
    for words in (
        "x y z",
        "u v w",
        "before after",
        "low high",
        "lowest highest",
        "least most",
        "first second last",
        "left right",
        "old new",
        "start stop end begin",
        "expected requested actual",
        "given found",
        "wanted seen",
        "row column",
        "width height",
        "upper lower",
        "min max",
        "a b c",
    )
)
"""Words for things that come in pairs."""


class _Finder(ast.NodeVisitor):
    """Walks through a module and keeps the possible changes."""

    def __init__(self, file: str, source: bytes) -> None:
        self.found: list[Mutant] = []
        self._file = file
        self._source = source
        self._starts = [0]
        for line in source.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))
        self._scopes: list[str] = []
        self._depth = 0
        self._statement = (1, 1)

    # The present place.

    def visit(self, node: ast.AST) -> None:
        if isinstance(node, ast.stmt):
            around = self._statement
            self._statement = (node.lineno, _head_end(node))
            super().visit(node)
            self._statement = around
        else:
            super().visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        if node.name == "__repr__" or _decorated(node.decorator_list, "overload"):
            return
        for decorator in node.decorator_list:
            self.visit(decorator)
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self.visit(default)
        self._scopes.append(node.name)
        self._depth += 1
        self._block(node.body)
        self._depth -= 1
        self._scopes.pop()

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        self.visit_FunctionDef(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for decorator in node.decorator_list:
            if not _decorated([decorator], "dataclass"):
                self.visit(decorator)
        self._scopes.append(node.name)
        for one in node.body:
            self.visit(one)
        self._scopes.pop()

    def visit_Lambda(self, node: ast.Lambda) -> None:
        self._depth += 1
        self.visit(node.body)
        self._depth -= 1

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_Assign(self, node: ast.Assign) -> None:
        if not any(isinstance(one, ast.Name) and one.id == "__all__" for one in node.targets):
            self.generic_visit(node)

    def visit_Import(self, node: ast.Import) -> None:
        """Skip it: nothing in it is changed."""

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        """Skip it: nothing in it is changed."""

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Skip it: up to Python 3.11 its parts have no positions of their own."""

    # The changes.

    def visit_If(self, node: ast.If) -> None:
        if isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            return
        self._condition(node.test)
        self.visit(node.test)
        self._block(node.body)
        self._block(node.orelse)

    def visit_While(self, node: ast.While) -> None:
        self._condition(node.test)
        self.visit(node.test)
        self._block(node.body)
        self._block(node.orelse)

    def visit_For(self, node: ast.For) -> None:
        self.visit(node.iter)
        self._block(node.body)
        self._block(node.orelse)

    def visit_With(self, node: ast.With) -> None:
        first = node.items[0]
        if (
            len(node.items) == 1
            and first.optional_vars is None
            and "suppress" not in ast.unparse(first.context_expr)
        ):
            begin, end = self._at(node), self._span(first.context_expr)[1]
            self._keep(Kind.CALL, node, begin, end, "if True")
        for item in node.items:
            self.visit(item.context_expr)
        self._block(node.body)

    def visit_Try(self, node: ast.Try) -> None:
        self._block(node.body)
        for handler in node.handlers:
            self._block(handler.body)
        self._block(node.orelse)
        self._block(node.finalbody)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):
            return  # a docstring
        if isinstance(node.value, ast.Call) and self._depth:
            self._keep(Kind.CALL, node, *self._span(node), "pass")
        self.visit(node.value)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._condition(node.test)
        self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> None:
        for condition in node.ifs:
            self._condition(condition)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not):
            self._keep(Kind.NEGATION, node, *self._span(node), f"({self._text(node.operand)})")
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        left, right = node.values[0], node.values[1]
        begin, end = self._span(left)[1], self._span(right)[0]
        between = self._source[begin:end].decode()
        text = self._source[self._span(left)[0] : self._span(right)[1]].decode()
        changed = re.sub(rf"\b{old}\b", new, between, count=1)
        after = self._text(left) + changed + self._text(right)
        if changed != between and after != text:
            self._keep(Kind.NEGATION, node, self._span(left)[0], self._span(right)[1], after)
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        operands = [node.left, *node.comparators]
        for number, operator in enumerate(node.ops):
            pattern, new = _TURNED[type(operator)]
            left, right = operands[number], operands[number + 1]
            begin, end = self._span(left)[1], self._span(right)[0]
            between = self._source[begin:end].decode()
            changed = re.sub(rf"(?<![\w<>=!]){pattern}(?![\w<>=!])", new, between, count=1)
            if changed != between:
                after = self._text(left) + changed + self._text(right)
                span = self._span(left)[0], self._span(right)[1]
                self._keep(Kind.COMPARISON, node, *span, after)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        if isinstance(node.op, ast.Sub | ast.Div | ast.FloorDiv | ast.Mod | ast.MatMult):
            left, right = self._text(node.left), self._text(node.right)
            begin, end = self._span(node.left)[1], self._span(node.right)[0]
            sign = re.sub(r"[()\s]", "", self._source[begin:end].decode())
            sound = sign in {"-", "/", "//", "%", "@"} and left != right
            if sound and not isinstance(node.left, ast.Constant | ast.JoinedStr):
                self._keep(Kind.ORDER, node, *self._span(node), f"({right}) {sign} ({left})")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        name = _name(node.func)
        if name in _SENTENCES:
            for keyword in node.keywords:
                self.visit(keyword.value)
            return
        given = node.args
        if len(given) == 1 and not node.keywords and name in _ALIKE:
            self._keep(Kind.CALL, node, *self._span(node), f"({self._text(given[0])})")
        if (
            not given
            and not node.keywords
            and name in _ALIKE
            and isinstance(node.func, ast.Attribute)
        ):
            self._keep(Kind.CALL, node, *self._span(node), self._text(node.func.value))
        for first, second in pairwise(given):
            if _may_be_mixed_up(first, second):
                self._swap(node, first, second)
        self.visit(node.func)
        for one in given:
            self.visit(one)
        for keyword in node.keywords:
            if keyword.arg not in _FOR_PEOPLE:
                self.visit(keyword.value)

    def visit_Constant(self, node: ast.Constant) -> None:
        after = _other(node.value)
        if after:
            self._keep(Kind.CONSTANT, node, *self._span(node), after)

    # Keeping a change.

    def _block(self, body: Sequence[ast.stmt]) -> None:
        for first, second in pairwise(body):
            if self._depth and _may_swap(first, second):
                begin, end = self._span(first)[0], self._span(second)[1]
                between = self._source[self._span(first)[1] : self._span(second)[0]].decode()
                after = self._text(second) + between + self._text(first)
                self._keep(Kind.ORDER, first, begin, end, after, last_line=second.end_lineno)
        for one in body:
            self.visit(one)

    def _swap(self, node: ast.expr, first: ast.expr, second: ast.expr) -> None:
        left, right = self._text(first), self._text(second)
        begin, end = self._span(first)[0], self._span(second)[1]
        between = self._source[self._span(first)[1] : self._span(second)[0]].decode()
        if left != right:
            self._keep(Kind.ORDER, node, begin, end, right + between + left)

    def _condition(self, test: ast.expr) -> None:
        """Keep the negation, unless another kind of change has the same effect."""
        if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
            return
        if (
            isinstance(test, ast.Compare)
            and len(test.ops) == 1
            and not isinstance(test.ops[0], _ORDERED)
        ):
            return
        self._keep(Kind.NEGATION, test, *self._span(test), f"(not ({self._text(test)}))")

    def _keep(
        self,
        kind: Kind,
        node: ast.expr | ast.stmt,
        begin: int,
        end: int,
        after: str,
        *,
        last_line: int | None = None,
    ) -> None:
        self.found.append(
            Mutant(
                file=self._file,
                where=".".join(self._scopes),
                kind=kind,
                line=node.lineno,
                last_line=last_line or _head_end(node),
                statement=self._statement,
                called=self._depth > 0,
                begin=begin,
                end=end,
                before=self._source[begin:end].decode(),
                after=after,
            )
        )

    def _at(self, node: ast.expr | ast.stmt) -> int:
        return self._starts[node.lineno - 1] + node.col_offset

    def _span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        last, column = node.end_lineno or node.lineno, node.end_col_offset or 0
        return self._at(node), self._starts[last - 1] + column

    def _text(self, node: ast.expr | ast.stmt) -> str:
        begin, end = self._span(node)
        return self._source[begin:end].decode()


def _name(function: ast.expr) -> str:
    if isinstance(function, ast.Name):
        return function.id
    return function.attr if isinstance(function, ast.Attribute) else ""


def _decorated(decorators: Sequence[ast.expr], name: str) -> bool:
    bare = [one.func if isinstance(one, ast.Call) else one for one in decorators]
    return name in {_name(one) for one in bare}


def _head_end(node: ast.expr | ast.stmt) -> int:
    """Return the last line of a statement without its body."""
    body: list[ast.stmt] = getattr(node, "body", [])
    if isinstance(node, ast.stmt) and isinstance(body, list) and body:
        return max(node.lineno, body[0].lineno - 1)
    return node.end_lineno or node.lineno


def _other(value: object) -> str:
    """Return another constant of the same type, as text; empty if there is no good one."""
    if isinstance(value, bool):
        return str(not value)
    if isinstance(value, int):
        return str(value + 1)
    if isinstance(value, float):
        return repr(value * 1.5 + 0.5 if value == 0 else value * 1.5)
    return ""


def _may_be_mixed_up(first: ast.expr, second: ast.expr) -> bool:
    """Return whether two arguments look alike: a pair, or of the same unit or noun."""
    numbers = [one.value for one in (first, second) if isinstance(one, ast.Constant)]
    if len(numbers) == 2:
        return isinstance(numbers[0], int | float) and isinstance(numbers[1], int | float)
    words = [_name(one).strip("_").split("_") for one in (first, second)]
    if not (words[0][0] and words[1][0]):
        return False
    if words[0][-1] == words[1][-1]:
        return True
    return any(
        twins >= {one[0], other[0]} or twins >= {one[-1], other[-1]}
        for twins in _TWINS
        for one, other in [words]
    )


def _may_swap(first: ast.stmt, second: ast.stmt) -> bool:
    """Return whether two statements could be swapped without a missing name."""
    simple = (ast.Expr, ast.Assign, ast.AugAssign, ast.AnnAssign)
    if not (isinstance(first, simple) and isinstance(second, simple)):
        return False
    if not any(isinstance(one, ast.Call) for node in (first, second) for one in ast.walk(node)):
        return False  # nobody sees in which order two plain values were kept
    if all(isinstance(one, ast.Assign) and _is_local(one) for one in (first, second)):
        return False  # the values of two locals seldom depend on their order
    if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
        return False
    if isinstance(second, ast.Expr) and isinstance(second.value, ast.Constant):
        return False
    stored, loaded = _names(first)
    stored_after, loaded_after = _names(second)
    return not (stored & (stored_after | loaded_after) or stored_after & loaded)


def _is_local(node: ast.Assign) -> bool:
    return all(isinstance(one, ast.Name | ast.Tuple) for one in node.targets)


def _names(node: ast.stmt) -> tuple[set[str], set[str]]:
    stored: set[str] = set()
    loaded: set[str] = set()
    for one in ast.walk(node):
        if isinstance(one, ast.Name):
            (stored if isinstance(one.ctx, ast.Store) else loaded).add(one.id)
        elif isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Store):
            stored.add(ast.unparse(one))
        elif isinstance(one, ast.Attribute):
            loaded.add(ast.unparse(one))
    return stored, loaded
