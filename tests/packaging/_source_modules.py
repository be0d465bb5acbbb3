"""The modules of the sources, as far as it is needed to follow a value through them."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

Node = Any  # of ast
Chosen = dict[str, str]
"""Which branch was taken at each place where sentences part."""


def together(*parts: Chosen) -> Chosen | None:
    """Return what was chosen in all of them, ``None`` where two exclude each other."""
    made: Chosen = {}
    for part in parts:
        for place, branch in part.items():
            if made.setdefault(place, branch) != branch:
                return None
    return made


@dataclass(frozen=True, eq=False)
class Scope:
    """A function, or the top of a module, in which a name has a meaning."""

    module: "Module"
    node: Node
    owner: str = ""
    given: dict[str, tuple[Node, "Scope"]] = field(default_factory=dict)
    """What a caller gives for the parameters, and where it does."""
    outer: "Scope | None" = None

    @cached_property
    def chosen(self) -> dict[Node, Chosen]:
        """The branches in which each statement of this scope stands."""
        return self.module.branches(self.node)

    @property
    def annotated(self) -> dict[str, str]:
        """The types of the parameters and of what is caught, as they are said."""
        found = {}
        for node in self.chosen:
            match node:
                case ast.arg(arg=name, annotation=annotation) if annotation is not None:
                    found[name] = ast.unparse(annotation)
                case ast.ExceptHandler(type=kind, name=str(name)) if kind is not None:
                    found[name] = ast.unparse(kind)
        return found

    @cached_property
    def parameters(self) -> dict[str, Node | None]:
        """The parameters with their defaults."""
        if not isinstance(self.node, ast.FunctionDef | ast.Lambda):
            return {}
        args = self.node.args
        plain = [*args.posonlyargs, *args.args]
        missing: list[Node | None] = [None] * (len(plain) - len(args.defaults))
        found = dict(zip([one.arg for one in plain], [*missing, *args.defaults], strict=True))
        return found | dict(
            zip([one.arg for one in args.kwonlyargs], args.kw_defaults, strict=True)
        )


class Module:
    """One source file."""

    def __init__(self, root: Path, path: Path) -> None:
        self.place = path.relative_to(root).as_posix()
        self.tree = ast.parse(path.read_text(encoding="utf-8"))
        parts = list(path.relative_to(root).with_suffix("").parts)
        parts = parts[1:] if parts[0] in ("cli", "simulators") else parts
        self.is_package = parts[-1] == "__init__"
        self.name = ".".join(parts[:-1] if self.is_package else parts)
        self.imported: dict[str, tuple[str, str]] = {}
        self.functions: dict[tuple[str, str], ast.FunctionDef] = {}
        self.classes: dict[str, ast.ClassDef] = {}
        self.calls: list[tuple[ast.Call, ast.FunctionDef | None, str]] = []
        self._branches: dict[Node, dict[Node, Chosen]] = {}
        self._had: dict[Node, dict[str, list[str]]] = {}
        self._read(self.tree, "", None)

    def _read(self, node: Node, owner: str, within: ast.FunctionDef | None) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.ImportFrom):
                for one in child.names:
                    self.imported[one.asname or one.name] = (child.module or "", one.name)
            elif isinstance(child, ast.Import):
                for one in child.names:
                    self.imported[one.asname or one.name] = (one.name, "")
            elif isinstance(child, ast.Call):
                self.calls.append((child, within, owner))
            if isinstance(child, ast.FunctionDef):
                self.functions.setdefault((owner, child.name), child)
                self._read(child, owner, child)
            elif isinstance(child, ast.ClassDef):
                self.classes[child.name] = child
                self._read(child, child.name, within)
            else:
                self._read(child, owner, within)

    def has(self, kind: ast.ClassDef) -> dict[str, list[str]]:
        """Return what a class has, each with what its type is said to be."""
        if kind not in self._had:
            self._had[kind] = self._what_has(kind)
        return self._had[kind]

    def _what_has(self, kind: ast.ClassDef) -> dict[str, list[str]]:
        found: dict[str, list[str]] = defaultdict(list)
        for node in ast.walk(kind):
            match node:
                case ast.AnnAssign(target=ast.Name(id=name) | ast.Attribute(attr=name)):
                    found[name].append(ast.unparse(node.annotation))
                case ast.FunctionDef(name=name, returns=returns):
                    found[name] += [ast.unparse(returns)] if returns else []
                    known = {
                        one.arg: one.annotation for one in node.args.args + node.args.kwonlyargs
                    }
                    for one in ast.walk(node) if name == "__init__" else ():
                        match one:
                            case ast.Assign(targets=[ast.Attribute(attr=attr)], value=value):
                                said = known.get(getattr(value, "id", ""))
                                found[attr] += [ast.unparse(said)] if said else []
                                if isinstance(value, ast.Call):
                                    found[attr].append(named(value))
                            case ast.Assign(
                                targets=[ast.Tuple(elts=many)], value=ast.Tuple(elts=values)
                            ):
                                for target, value in zip(many, values, strict=True):
                                    said = known.get(getattr(value, "id", ""))
                                    attr = getattr(target, "attr", "")
                                    found[attr] += [ast.unparse(said)] if said else []
        return found

    def branches(self, function: Node) -> dict[Node, Chosen]:
        """Return in which branches each node of a function stands."""
        if function not in self._branches:
            self._branches[function] = {}
            self._note(function, {}, self._branches[function])
        return self._branches[function]

    def _note(self, node: Node, chosen: Chosen, found: dict[Node, Chosen]) -> None:
        for name, value in ast.iter_fields(node):
            children: list[Any] = value if isinstance(value, list) else [value]
            for child in children:
                if isinstance(child, ast.AST):
                    there = chosen
                    if isinstance(node, ast.If | ast.IfExp) and name in ("body", "orelse"):
                        there = chosen | branch_of(node.test, taken=name == "body")
                    elif isinstance(node, ast.Match) and name == "cases":
                        there = chosen | {
                            f"match {node.lineno}": str(getattr(child, "pattern", node).lineno)
                        }
                    found[child] = there
                    self._note(child, there, found)


def branch_of(test: Node, *, taken: bool) -> Chosen:
    """Return what is chosen by a condition; its opposite is the other branch of the same."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return branch_of(test.operand, taken=not taken)
    return {f"if {ast.unparse(test)}": str(taken)}


def is_abstract(function: ast.FunctionDef) -> bool:
    """Return whether heirs say what a method does."""
    return any(named(one) == "abstractmethod" for one in function.decorator_list)


def unpacked(target: Node, name: str) -> Iterator[tuple[int, ...]]:
    """Yield the way to a name in what is assigned at once."""
    match target:
        case ast.Name(id=found) if found == name:
            yield ()
        case ast.Tuple(elts=elements):
            for number, one in enumerate(elements):
                yield from ((number, *way) for way in unpacked(one, name))


def called(call: ast.Call) -> str:
    """Return the name of what is called, without what it belongs to."""
    return getattr(call.func, "id", "") or getattr(call.func, "attr", "")


def named(node: Node) -> str:
    """Return the name of a value."""
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
        case ast.Call(func=func):
            return named(func)
        case ast.Subscript(value=value):
            return named(value)
        case _:
            return "value"


def arguments(call: ast.Call, scope: Scope) -> dict[str, Node]:
    """Return what a call gives for the parameters of a function."""
    names = list(scope.parameters)
    if names[:1] in (["self"], ["cls"]):
        names = names[1:]
    given = dict(zip(names, call.args, strict=False))
    return given | {one.arg: one.value for one in call.keywords if one.arg}
