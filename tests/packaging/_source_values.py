"""What a name, an attribute, an item or a call in the sources can stand for; nothing is run."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from tests.packaging._source_modules import (
    Chosen,
    Module,
    Node,
    Scope,
    arguments,
    branch_of,
    called,
    is_abstract,
    named,
    unpacked,
)

DEEPEST = 24
MOST_CALLERS = 3
"""So many callers up, a parameter is followed."""


class Values:
    """All modules, and what the expressions in them can stand for.

    Args:
        root: Folder of the project.
        folders: Those below it that are shipped.
    """

    def __init__(self, root: Path, folders: tuple[str, ...]) -> None:
        paths = [path for folder in folders for path in sorted((root / folder).rglob("*.py"))]
        self.modules = {one.name: one for one in (Module(root, path) for path in paths)}
        self._callers: dict[str, list[tuple[ast.Call, Scope]]] = defaultdict(list)
        self._returned: dict[ast.FunctionDef, list[tuple[ast.expr, Chosen]]] = {}
        self._under_way: list[tuple[object, ...]] = []
        self._far = True
        self._cut = 0
        self._heirs: dict[str, list[tuple[Module, ast.ClassDef]]] = defaultdict(list)
        self._makers: dict[str, set[str]] = defaultdict(set)
        self._fulfilled: dict[ast.ClassDef, list[tuple[Module, ast.ClassDef]]] = {}
        for module in self.modules.values():
            for kind in module.classes.values():
                for base in kind.bases:
                    self._heirs[named(base)].append((module, kind))
            for owner, name in module.functions:
                self._makers[name].add(owner)
            for call, within, owner in module.calls:
                if name := called(call):
                    scope = self.scope(module, within, owner)
                    self._callers[name].append((call, scope))

    def scope(self, module: Module, within: ast.FunctionDef | None, owner: str) -> Scope:
        """Return the scope of a call."""
        top = Scope(module, module.tree)
        return top if within is None else Scope(module, within, owner, outer=top)

    def values(self, node: Node, scope: Scope) -> Iterator[tuple[Node, Scope, Chosen]]:
        """Yield the expressions that a name, an attribute or an item stands for."""
        far = isinstance(node, ast.Name) and node.id in scope.parameters and not scope.given
        key = (ast.unparse(node), scope.node, far, "values")
        if key in self._under_way or len(self._under_way) > DEEPEST:
            return
        self._under_way.append(key)
        try:
            found = list(self._values(node, scope))
        finally:
            self._under_way.pop()
        yield from found

    def _values(self, node: Node, scope: Scope) -> Iterator[tuple[Node, Scope, Chosen]]:
        match node:
            case ast.Name(id=name):
                yield from self._of_name(name, scope)
            case ast.Attribute(value=ast.Name(id="self"), attr=name):
                yield from self._of_self(name, scope)
            case ast.Attribute(value=of, attr=attr):
                module = self._module_of(getattr(of, "id", ""), scope)
                if module is not None:
                    yield from self._of_name(attr, Scope(module, module.tree))
                    return
                for module, kind in self.kinds(of, scope, attr):
                    for one, where, chosen in self._of_self(attr, Scope(module, kind, kind.name)):
                        if getattr(one, "attr", "") != attr:  # else it is what another one says
                            yield one, where, chosen
            case ast.Subscript(value=table, slice=index):
                yield from self._items(table, index, scope)

    def _module_of(self, name: str, scope: Scope) -> Module | None:
        if name not in scope.module.imported:
            return None
        origin, one = scope.module.imported[name]
        return self.modules.get(f"{origin}.{one}" if one else origin)

    def _of_name(self, name: str, scope: Scope) -> Iterator[tuple[Node, Scope, Chosen]]:
        if name in scope.given:
            node, where = scope.given[name]
            yield node, where, {}
            return
        assigned = list(self._assigned(name, scope))
        yield from assigned
        if name in scope.parameters and not scope.given and not self._far:
            return
        if name in scope.parameters and not scope.given:
            yield from self._handed_in(name, scope)
        elif name in scope.parameters and scope.parameters[name] is not None:
            yield scope.parameters[name], scope, {}  # not given by this caller
        elif not assigned and scope.outer is not None:
            yield from self._of_name(name, scope.outer)
        elif not assigned and name in scope.module.imported:
            origin, one = scope.module.imported[name]
            module = self._defining(origin, one)
            if module is not None:
                yield from self._of_name(one, Scope(module, module.tree))

    def _assigned(self, name: str, scope: Scope) -> Iterator[tuple[Node, Scope, Chosen]]:
        for node, chosen in scope.chosen.items():
            match node:
                case ast.Assign(targets=[target], value=value) if value:
                    pass
                case ast.AnnAssign(target=target, value=value) if value:
                    pass
                case ast.NamedExpr(target=target, value=value):
                    pass
                case (
                    ast.For(target=target, iter=value)
                    | ast.comprehension(target=target, iter=value)
                ):
                    value = ast.Subscript(value, ast.Name("any"))
                case ast.AugAssign(target=ast.Name(id=found), value=value) if found == name:
                    before = ast.Name(name)
                    yield ast.BinOp(before, ast.Add(), value), scope, chosen
                    continue
                case _:
                    continue
            for way in unpacked(target, name):
                there = value
                for index in way:
                    there = ast.Subscript(there, ast.Constant(index))
                yield there, scope, chosen

    def _handed_in(self, name: str, scope: Scope) -> Iterator[tuple[Node, Scope, Chosen]]:
        function = scope.node
        if sum(key[-1] == "values" and bool(key[2]) for key in self._under_way) > MOST_CALLERS:
            self._cut += 1
            return
        name_there = scope.owner if function.name == "__init__" else function.name
        for number, (call, where) in enumerate(self._callers[name_there]):
            if not self._means(call, where, function, scope):
                continue
            given = arguments(call, scope)
            value = given.get(name, scope.parameters[name])
            if value is not None:
                chosen = where.chosen.get(call, {})
                at = {f"{where.module.place}: {key}": way for key, way in chosen.items()}
                yield (
                    value,
                    where if name in given else scope,
                    at | {f"call of {function.name}": str(number)},
                )

    def _means(self, call: ast.Call, where: Scope, function: Node, scope: Scope) -> bool:
        """Return whether a call is one of this function, and not of a namesake."""
        if isinstance(call.func, ast.Attribute):
            of = call.func.value
            if not scope.owner:
                return self._module_of(getattr(of, "id", ""), where) is scope.module
            if getattr(of, "id", "") == "self":
                return any(
                    kind.name == scope.owner for _, kind in self._family(where.owner, where.module)
                )
            kinds = [kind.name for _, kind in self.kinds(of, where, function.name)]
            return scope.owner in kinds or (
                not kinds and self._makers[function.name] == {scope.owner}
            )
        if function.name == "__init__":
            return True
        if where.module is scope.module:
            return not scope.owner
        origin, one = where.module.imported.get(named(call.func), ("", ""))
        return self._defining(origin, one) is scope.module

    def _of_self(self, name: str, scope: Scope) -> Iterator[tuple[Node, Scope, Chosen]]:
        for owner in self._family(scope.owner, scope.module):
            module, kind = owner
            function = module.functions.get((kind.name, name))
            if function is not None:  # a property
                yield from self._returns(function, Scope(module, function, kind.name))
                return
            for (of, _), method in module.functions.items():
                if of != kind.name:
                    continue
                there = Scope(module, method, of, outer=Scope(module, module.tree))
                for node, chosen in there.chosen.items():
                    match node:
                        case ast.Assign(
                            targets=[ast.Attribute(value=ast.Name(id="self"), attr=found)]
                        ) if found == name:
                            yield node.value, there, chosen
            for node in kind.body:
                match node:
                    case ast.Assign(targets=[ast.Name(id=found)]) if found == name:
                        yield node.value, Scope(module, module.tree), {}
                    case ast.AnnAssign(target=ast.Name(id=found)) if found == name:
                        yield from self._made_with(kind, module, name, node.value)

    def _made_with(
        self, kind: ast.ClassDef, module: Module, name: str, default: Node | None
    ) -> Iterator[tuple[Node, Scope, Chosen]]:
        """Yield what a dataclass is made with."""
        fields = [named(one.target) for one in kind.body if isinstance(one, ast.AnnAssign)]
        for call, where in self._callers[kind.name]:
            given = dict(zip(fields, call.args, strict=False))
            given |= {one.arg: one.value for one in call.keywords if one.arg}
            if name in given:
                yield given[name], where, {}
            elif default is not None:
                yield default, Scope(module, module.tree), {}

    def _family(self, owner: str, module: Module) -> Iterator[tuple[Module, ast.ClassDef]]:
        if owner in module.classes:
            kind = module.classes[owner]
            yield module, kind
            for base in kind.bases:
                name = named(base)
                origin, one = module.imported.get(name, (module.name, name))
                there = self._defining(origin, one)
                if there is not None:
                    yield from self._family(one, there)

    def kinds(self, node: Node, scope: Scope, attr: str) -> Iterator[tuple[Module, ast.ClassDef]]:
        """Yield the classes that an expression may be of, as far as they have ``attr``."""
        key = (ast.unparse(node), scope.node, "kinds", attr)
        if not self._far or key in self._under_way or len(self._under_way) > DEEPEST:
            return
        self._under_way.append(key)
        try:
            annotations = list(self._annotations(node, scope))
        finally:
            self._under_way.pop()
        seen = set()
        for annotation, where in annotations:
            for name in re.findall(r"\w+", annotation):
                origin, one = where.module.imported.get(name, (where.module.name, name))
                module = self._defining(origin, one)
                if module is None or one in seen:
                    continue
                seen.add(one)
                if one not in module.classes:
                    top = Scope(module, module.tree)  # an alias, perhaps
                    annotations += [(ast.unparse(of), top) for of, *_ in self._assigned(one, top)]
                elif any(attr in owner.has(kind) for owner, kind in self._family(one, module)):
                    yield module, module.classes[one]
                    yield from self._fulfilling(module.classes[one])

    def _fulfilling(self, protocol: ast.ClassDef) -> list[tuple[Module, ast.ClassDef]]:
        """Return the classes that have all that a protocol names."""
        if not any(named(one) == "Protocol" for one in protocol.bases):
            return []
        if protocol not in self._fulfilled:
            names = {one.name for one in protocol.body if isinstance(one, ast.FunctionDef)}
            self._fulfilled[protocol] = [
                (module, kind)
                for module in self.modules.values()
                for kind in module.classes.values()
                if kind is not protocol and names <= self._names_in(kind, module)
            ]
        return self._fulfilled[protocol]

    def _names_in(self, kind: ast.ClassDef, module: Module) -> set[str]:
        family = self._family(kind.name, module)
        return {one for owner, base in family for one in owner.has(base)}

    def _annotations(self, node: Node, scope: Scope) -> Iterator[tuple[str, Scope]]:
        match node:
            case ast.Name(id=name):
                for arg, annotation in scope.annotated.items():
                    if arg == name:
                        yield annotation, scope
                for one, where, _ in self._assigned(name, scope):
                    if not any(getattr(part, "id", "") == name for part in ast.walk(one)):
                        yield from self._annotations(one, where)
            case ast.Subscript(value=value):
                yield from self._annotations(value, scope)
            case ast.Call():
                yield named(node.func), scope
                found = self.function(node, scope)
                if found is not None and found[0].returns is not None:
                    yield ast.unparse(found[0].returns), Scope(found[1], found[0], found[2])
                if found is None and isinstance(node.func, ast.Attribute):
                    for module, kind in self.kinds(node.func.value, scope, node.func.attr):
                        method = module.functions.get((kind.name, node.func.attr))
                        if method is not None and method.returns is not None:
                            yield ast.unparse(method.returns), Scope(module, method, kind.name)
            case ast.Attribute(value=of, attr=attr):
                owners = (
                    list(self._family(scope.owner, scope.module))
                    if getattr(of, "id", "") == "self"
                    else list(self.kinds(of, scope, attr))
                )
                for module, kind in owners:
                    for annotation in module.has(kind).get(attr, ()):
                        yield annotation, Scope(module, kind, kind.name)

    # Items of tables and of what functions return.

    def _items(
        self, table: Node, index: Node, scope: Scope
    ) -> Iterator[tuple[Node, Scope, Chosen]]:
        key = (ast.unparse(table), scope.node, "items")
        if key in self._under_way or len(self._under_way) > DEEPEST:
            return
        self._under_way.append(key)
        try:
            found = list(self._items_of(table, index, scope))
        finally:
            self._under_way.pop()
        yield from found

    def _items_of(
        self, table: Node, index: Node, scope: Scope
    ) -> Iterator[tuple[Node, Scope, Chosen]]:
        wanted = index.value if isinstance(index, ast.Constant) else None
        match table:
            case ast.Tuple(elts=elements) | ast.List(elts=elements) | ast.Set(elts=elements):
                if isinstance(wanted, int):
                    yield from [(elements[wanted], scope, {})] if wanted < len(elements) else []
                else:
                    for number, one in enumerate(elements):
                        yield one, scope, {f"{table.lineno}": str(number)}
            case ast.Dict(keys=keys, values=values):
                for key, value in zip(keys, values, strict=True):
                    if isinstance(index, ast.Constant) and isinstance(key, ast.Constant):
                        if key.value == wanted:
                            yield value, scope, {}
                    else:
                        yield value, scope, {f"{table.lineno} [{ast.unparse(index)}]": str(key)}
            case ast.IfExp(test=test, body=body, orelse=orelse):
                for node, taken in ((body, True), (orelse, False)):
                    for one, where, chosen in self._items(node, index, scope):
                        yield one, where, chosen | branch_of(test, taken=taken)
            case ast.BoolOp(values=values):
                for node in values:
                    yield from self._items(node, index, scope)
            case ast.Constant(value=None):
                return
            case ast.Call():
                for one, where, chosen in self._of_call(table, scope):
                    for item, there, more in self._items(one, index, where):
                        yield item, there, chosen | more
            case ast.Name() | ast.Attribute() | ast.Subscript():
                for one, where, chosen in self.values(table, scope):
                    for item, there, more in self._items(one, index, where):
                        yield item, there, chosen | more

    def _of_call(self, call: ast.Call, scope: Scope) -> Iterator[tuple[Node, Scope, Chosen]]:
        """Yield what the called function returns, with what this call gives it."""
        found = self.function(call, scope)
        if found is None:
            match call.func:
                case ast.Name():
                    for one, where, chosen in self.values(call.func, scope):
                        if isinstance(one, ast.Lambda):
                            yield one.body, where, chosen
                        elif isinstance(one, ast.Name):
                            made = ast.Call(one, call.args, call.keywords, lineno=call.lineno)
                            for text, there, more in self._of_call(made, where):
                                yield text, there, chosen | more
                case ast.Attribute(value=ast.Name(id="self"), attr=attr):
                    for module, kind in self._heirs.get(scope.owner, ()):
                        if (kind.name, attr) in module.functions:
                            method = module.functions[kind.name, attr]
                            yield from self._called_of(call, scope, (method, module, kind.name))
                    for one, where, chosen in self.values(call.func, scope):
                        if isinstance(one, ast.Lambda):
                            yield one.body, where, chosen
                case ast.Attribute(value=of, attr=attr):
                    for module, kind in self.kinds(of, scope, attr):
                        if (kind.name, attr) in module.functions:
                            method = module.functions[kind.name, attr]
                            yield from self._called_of(call, scope, (method, module, kind.name))
            return
        yield from self._called_of(call, scope, found)

    def _called_of(
        self, call: ast.Call, scope: Scope, found: tuple[ast.FunctionDef, Module, str]
    ) -> Iterator[tuple[Node, Scope, Chosen]]:
        function, module, owner = found
        there = Scope(module, function, owner, outer=Scope(module, module.tree))
        given = {name: (value, scope) for name, value in arguments(call, there).items()}
        there = Scope(module, function, owner, given or {"": (call, scope)}, there.outer)
        key = f"{scope.module.place}:{call.lineno}"
        for number, (value, where, chosen) in enumerate(self._returns(function, there)):
            inside = {f"{key} {place}": way for place, way in chosen.items()}
            yield value, where, inside | {f"{key} {function.name}": str(number)}

    def _returns(
        self, function: ast.FunctionDef, scope: Scope
    ) -> Iterator[tuple[Node, Scope, Chosen]]:
        if function not in self._returned:
            self._returned[function] = [
                (node.value, chosen)
                for node, chosen in scope.chosen.items()
                if isinstance(node, ast.Return | ast.Yield) and node.value is not None
            ]
        for value, chosen in self._returned[function]:
            yield value, scope, chosen

    def function(self, call: ast.Call, scope: Scope) -> tuple[ast.FunctionDef, Module, str] | None:
        """Return the function that a call means, where that can be told."""
        module: Module | None = scope.module
        owner = ""
        match call.func:
            case ast.Name(id=name):
                if ("", name) not in scope.module.functions and name in scope.module.imported:
                    origin, name = scope.module.imported[name]
                    module = self._defining(origin, name)
            case ast.Attribute(value=ast.Name(id="self"), attr=name):
                for there, kind in self._family(scope.owner, scope.module):
                    function = there.functions.get((kind.name, name))
                    if function is not None and not is_abstract(function):
                        return function, there, kind.name
                return None
            case ast.Attribute(value=ast.Name(id=of), attr=name):
                module = self._module_of(of, scope)
            case _:
                return None
        if module is None or (owner, name) not in module.functions:
            return None
        return module.functions[owner, name], module, owner

    def _defining(self, origin: str, name: str) -> Module | None:
        """Return the module in which an imported name is made."""
        module = self.modules.get(origin)
        for _ in range(4):
            if module is None or name not in module.imported:
                return module
            if ("", name) in module.functions:
                return module
            module = self.modules.get(module.imported[name][0])
        return module
