"""What a raised error can say, read from the sources without running them.

A sentence is followed from where an error is made to the literals that it is made of: through
variables, branches, parameters and their callers, functions that return one, tables, and joined
parts. What excludes each other (two branches of one ``if``, two cases of one ``match``, two rows
of one table) is never put together.
"""

import ast
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import islice, product
from pathlib import Path

from robolink.messages import LIST_LINE
from tests.packaging._source_modules import Chosen, Node, Scope, branch_of, called, named, together
from tests.packaging._source_values import DEEPEST, Values

SENTENCE_MAKERS = ("tr", "declared", "spoken")
OF_ANOTHER = " ".join(["words of another error"] * 6)
"""Two lines: so many an error may take for what happened, and so many for what to do."""

MOST_AT_ONCE = 400
"""So many sentences of one expression are followed."""


@dataclass(frozen=True)
class Said:
    """One text that an expression can be, and which branches lead to it."""

    text: str
    chosen: Chosen = field(default_factory=dict)


class Sentences(Values):
    """All modules, and what the sentences in them can be.

    Args:
        root: Folder of the project.
        folders: Those below it that are shipped.
        fill: Returns a literal with likely values, given those that are sentences themselves.
    """

    def __init__(
        self, root: Path, folders: tuple[str, ...], fill: Callable[[str, dict[str, str]], str]
    ) -> None:
        super().__init__(root, folders)
        self._fill = fill
        self._known: dict[tuple[object, ...], list[Said] | None] = {}
        self._kept: list[Scope] = []

    # What an expression can be.

    def said(self, node: Node | None, scope: Scope) -> list[Said] | None:
        """Return all texts that an expression can be, ``None`` where it is not written here."""
        if node is None:
            return None
        key = (ast.unparse(node), scope.node, tuple(map(id, scope.given.values())), self._far)
        if key in self._known:
            return self._known[key]
        if key in self._under_way or len(self._under_way) > DEEPEST:
            self._cut += 1
            return None
        cut = self._cut
        self._under_way.append(key)
        try:
            found = self._said(node, scope)
        finally:
            self._under_way.pop()
        found = None if found is None else distinct(found)
        if found is not None or self._cut == cut:
            self._known[key] = found
            self._kept.append(scope)  # while a scope lives, nothing else gets the ids in its key
        return found

    def _said(self, node: Node, scope: Scope) -> list[Said] | None:
        match node:
            case ast.Constant(value=str(text)):
                return [Said(text)]
            case ast.Constant(value=None):
                return [Said("")]
            case ast.JoinedStr(values=parts):
                return self._concatenated([self._part(one, scope) for one in parts])
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return self._concatenated([self.said(left, scope), self.said(right, scope)])
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return self._either(
                    (self.said(body, scope), branch_of(test, taken=True)),
                    (self.said(orelse, scope), branch_of(test, taken=False)),
                )
            case ast.BoolOp(op=ast.Or(), values=values):
                found = [self.said(one, scope) for one in values]
                if None in found:
                    return None
                *first, last = found
                return [one for some in first for one in some or () if one.text] + (last or [])
            case ast.BoolOp(op=ast.And(), values=[*_, last]):
                ended = self.said(last, scope)
                return None if ended is None else [Said(""), *ended]
            case ast.Name(id=name):
                return self._named(name, scope)
            case ast.Call():
                return self._called(node, scope)
            case ast.Attribute(attr="what" | "remedy", value=of) if self._is_error(of, scope):
                return [Said(OF_ANOTHER)]
            case ast.Attribute(attr="strerror"):
                return [Said(self._fill("{cause}", {}))]
            case ast.Attribute() | ast.Subscript():
                return self._alternatives(node, scope, lambda one, where: self.said(one, where))
            case _:
                return None

    def _is_error(self, node: Node, scope: Scope) -> bool:
        said = [annotation for annotation, _ in self._annotations(node, scope)]
        return bool(said) and all(
            re.fullmatch(r"[\w\s().,|]*(Error|Exception)\W*", one) for one in said
        )

    def _part(self, part: Node, scope: Scope) -> list[Said] | None:
        if not isinstance(part, ast.FormattedValue):
            return self.said(part, scope)
        found = self._value(part.value, scope)
        if found is not None:
            return found
        form = ast.unparse(part.format_spec)[2:-1] if part.format_spec else ""
        name = named(part.value)
        return [Said(self._fill("{" + name + (f":{form}" if form else "") + "}", {}))]

    def _concatenated(
        self, parts: list[list[Said] | None], between: str = "", *, full: bool = False
    ) -> list[Said] | None:
        known = [part for part in parts if part is not None]
        if len(known) < len(parts):
            return None
        made = []
        for some in islice(product(*known), MOST_AT_ONCE * 20):
            chosen = together(*(one.chosen for one in some))
            if chosen is not None:
                texts = [one.text for one in some if one.text or not full]
                made.append(Said(between.join(texts), chosen))
        return made

    def _either(self, *ways: tuple[list[Said] | None, Chosen]) -> list[Said] | None:
        made = []
        for found, chosen in ways:
            if found is None:
                return None
            for one in found:
                both = together(one.chosen, chosen)
                if both is not None:
                    made.append(Said(one.text, both))
        return made

    # Names.

    def _named(self, name: str, scope: Scope) -> list[Said] | None:
        return self._alternatives(ast.Name(name), scope, lambda one, where: self.said(one, where))

    def _alternatives(
        self,
        node: Node,
        scope: Scope,
        follow: Callable[[Node, Scope], list[Said] | None],
    ) -> list[Said] | None:
        found = list(self.values(node, scope))
        if not found:
            return None
        made = []
        for one, where, chosen in found:
            texts = follow(one, where)
            if texts is None:
                return None
            made.append((texts, chosen))
        return self._either(*made)

    # Calls.

    def _called(self, call: Node, scope: Scope) -> list[Said] | None:
        name = called(call)
        if isinstance(call.func, ast.Name) and name in SENTENCE_MAKERS:
            return self._sentence(call, scope)
        if name == "listed" and isinstance(call.func, ast.Name):
            head = self.said(call.args[0], scope)
            return head and [Said(f"{one.text}\n{LIST_LINE}...", one.chosen) for one in head]
        if name in ("without", "first_sentence") and isinstance(call.func, ast.Name):
            return self.said(call.args[-1], scope)  # all of it, at the most
        if name == "joined" and isinstance(call.func, ast.Name):
            return self._joined(call.args[0], call.args[1], scope)
        if name == "known_names":
            return [Said("Choose one of 75: needle-beams, needle-pin ...")]
        if name == "remedy_word":
            return [Said(self._fill("{" + call.args[0].attr + "}", {}))]
        if name == "str" and len(call.args) == 1:
            of = call.args[0]
            return self.said(of, scope) or [Said(self._fill("{" + named(of) + "}", {}))]
        if name in ("tuple", "list") and len(call.args) == 1:
            return self._joined(ast.Constant(" "), call.args[0], scope)
        if isinstance(call.func, ast.Attribute):
            if name == "join":
                return self._joined(call.func.value, call.args[0], scope)
            if name in ("strip", "rstrip", "lstrip", "capitalize"):
                found = self.said(call.func.value, scope)
                return (
                    None if found is None else [Said(one.text.strip(), one.chosen) for one in found]
                )
            if name == "get":
                some = list(self._items(call.func.value, call.args[0], scope))
                rows = [(self.said(one, where), chosen) for one, where, chosen in some]
                last = self.said(call.args[1], scope) if call.args[1:] else [Said("")]
                return self._either(*rows, (last, {})) if rows else None
            if name == "replace":
                return [Said(self._fill("{" + named(call.func.value) + "}", {}))]
        returned = list(self._of_call(call, scope))
        if not returned:
            return None
        made = []
        for one, where, chosen in returned:
            texts = self.said(one, where)
            if texts is None:
                return None
            made.append((texts, chosen))
        return self._either(*made)

    def _sentence(self, call: ast.Call, scope: Scope) -> list[Said] | None:
        texts = self.said(call.args[0], scope)
        if texts is None:
            return None
        given = {
            one.arg: found
            for one in call.keywords
            if one.arg and (found := self._value(one.value, scope))
        }
        made = []
        for text in texts:
            for some in islice(product(*given.values()), MOST_AT_ONCE):
                chosen = together(text.chosen, *(one.chosen for one in some))
                if chosen is not None:
                    inside = dict(zip(given, (one.text for one in some), strict=True))
                    made.append(Said(self._fill(text.text, inside), chosen))
        return made

    def _value(self, node: Node, scope: Scope) -> list[Said] | None:
        """Return the sentences that stand for a value; ``None`` where it is no sentence."""
        before, self._far = self._far, False
        try:
            found = self.said(node, scope)
        finally:
            self._far = before
        is_word = isinstance(node, ast.Call) and called(node) == "remedy_word"
        return found if found and (is_word or all(" " in one.text for one in found)) else None

    def _joined(self, between: Node, parts: Node, scope: Scope) -> list[Said] | None:
        sign = str(between.value) if isinstance(between, ast.Constant) else " "
        full = False
        match parts:
            case ast.Call(func=ast.Name(id="filter"), args=[_, inner]):
                full, parts = True, inner
            case ast.GeneratorExp(elt=element) | ast.ListComp(elt=element):
                return self.said(element, scope)
            case ast.Call(func=ast.Name(id="tuple" | "list" | "sorted"), args=[inner]):
                return self._joined(between, inner, scope)
            case ast.Call():
                return self.said(parts, scope)
        if isinstance(parts, ast.Name):
            return self._grown(sign, parts, scope)
        if not isinstance(parts, ast.Tuple | ast.List):
            return None
        found = []
        for one in parts.elts:
            if isinstance(one, ast.Starred):
                match one.value:
                    case ast.IfExp(test=test, body=body, orelse=orelse):
                        ways = [(body, True), (orelse, False)]
                        some = [
                            (self._joined(between, way, scope), branch_of(test, taken=taken))
                            for way, taken in ways
                        ]
                        found.append(self._either(*some))
                    case _:
                        found.append(self._joined(between, one.value, scope))
                full = True
            else:
                found.append(self.said(one, scope))
        return self._concatenated(found, sign, full=full)

    def _grown(self, sign: str, parts: ast.Name, scope: Scope) -> list[Said] | None:
        """Return what a list makes that begins as another and to which sentences are added."""
        found = []
        for one, where, _ in self._assigned(parts.id, scope):
            refers = any(getattr(part, "id", "") == parts.id for part in ast.walk(one))
            if refers or (isinstance(one, ast.List) and not one.elts):
                continue
            found.append(self._joined(ast.Constant(sign), one, where))
        for node, chosen in scope.chosen.items():
            match node:
                case ast.Call(
                    func=ast.Attribute(value=ast.Name(id=name), attr="append"), args=[added]
                ) if name == parts.id:
                    some = self._either((self.said(added, scope), chosen))
                    found.append(None if some is None else [Said(""), *some])
        return self._concatenated(found, sign, full=True) if found else None


def distinct(found: list[Said]) -> list[Said]:
    """Return each text once a set of branches, the longest of them where there are many."""
    once = {(one.text, *sorted(one.chosen.items())): one for one in found}
    return sorted(once.values(), key=lambda one: -len(one.text))[:MOST_AT_ONCE]
