"""Declarations of the text: named types, variables, function blocks, lists of variables."""

from collections.abc import Iterator, Mapping

from lark import Token

from robolink.messages import tr
from robolink_simulators.structured_text.data_types import (
    ELEMENTARY,
    ArrayType,
    BlockType,
    DataType,
    Frame,
    ScalarType,
    StructType,
    TextVariable,
)
from robolink_simulators.structured_text.expressions import ExpressionTranslator, initial_value
from robolink_simulators.structured_text.functions import DIFFERING
from robolink_simulators.structured_text.parse import (
    Node,
    TextDialect,
    TextPlace,
    refused,
    require_name,
)
from robolink_simulators.structured_text.references import Runtime, TextScope
from robolink_simulators.structured_text.statements import bound_value

Listed = dict[str, tuple[Frame, TextVariable]]


class Declarations:
    """Everything that texts have declared so far; what is used must have been declared before.

    Args:
        known: Types that are there from the start.
        runtime: The running program.

    Attributes:
        types: Every named type, in capital letters.
        globals: Global variables.
        lists: The same under the names of their lists.
        runtime: The running program.
    """

    def __init__(self, known: Mapping[str, DataType], runtime: Runtime) -> None:
        self.types: dict[str, DataType] = {**ELEMENTARY, **known}
        self.globals: Listed = {}
        self.lists: dict[str, Listed] = {}
        self._own_lists: set[str] = set()
        self.runtime = runtime

    def scope(self, file: str, dialect: TextDialect, members: dict[str, TextVariable]) -> TextScope:
        """Return what the text of a block can name."""
        return TextScope(file, dialect, members, self.globals, self.lists, self.types, self.runtime)

    def declare_type(self, tree: Node, file: str, dialect: TextDialect) -> None:
        """Take in one definition of a type.

        Raises:
            StructuredTextError: The name is taken, or the type is unknown.
        """
        name, definition = tree.children
        self.require_free(name, file, dialect)
        if definition.data == "type_name":
            self.types[name.upper()] = self.type_of(definition, file, dialect)
            return
        *fields, ending = definition.children
        if ending is None and dialect is TextDialect.COMMON:
            raise refused(TextPlace.of(file, tree), tr("a semicolon follows END_STRUCT"))
        structure = StructType(str(name))
        for slot, field in enumerate(fields):
            member, of_tree, first = field.children
            low = require_name(member, file, dialect)
            if low in structure.members:
                raise refused(TextPlace.of(file, field), tr("{name} appears twice", name=low))
            of = self.type_of(of_tree, file, dialect)
            structure.members[low] = self._variable(low, of, slot, first, file, dialect)
        self.types[name.upper()] = structure

    def require_free(self, name: Token, file: str, dialect: TextDialect) -> None:
        """Refuse the name of a type or block that is there already, or no compiler takes."""
        require_name(name, file, dialect)
        self._require_alone(str(name), TextPlace.of(file, name))

    def _require_alone(self, name: str, place: TextPlace) -> None:
        if name.upper() in self.types or name.lower() in self._own_lists:
            raise refused(place, tr("{name} appears twice", name=name))

    def list_named(self, name: str, place: TextPlace) -> Listed:
        """Return a list of global variables, which is empty before its first declaration.

        Raises:
            StructuredTextError: A type or a block has its name; they are names of one kind.
        """
        low = name.lower()
        if low not in self._own_lists:
            self._require_alone(name, place)
            self._own_lists.add(low)
        return self.lists.setdefault(low, {})

    def type_of(self, tree: Node, file: str, dialect: TextDialect) -> DataType:
        """Return the type that a text names.

        Raises:
            StructuredTextError: It is unknown, or not of the subset.
        """
        first, *rest = tree.children
        place = TextPlace.of(file, tree)
        if not isinstance(first, Token):
            return self._array(first, file, dialect)
        name = ".".join(str(part) for part in (first, *rest) if part is not None)
        found = self.types.get(name.upper())
        if found is not None:
            return found
        if name.upper() in DIFFERING:
            raise refused(place, tr("compilers differ about {name}", name=name.upper()))
        raise refused(place, tr("there is no type {name} in the subset", name=name))

    def variables(
        self, sections: Iterator[Node], file: str, dialect: TextDialect
    ) -> dict[str, TextVariable]:
        """Return the variables of a block, in order."""
        members: dict[str, TextVariable] = {}
        for section in sections:
            kind_tree, *rest = section.children
            kind = str(kind_tree.children[0]).lower()
            words = {str(q.children[0]).upper() for q in rest if q.data == "qualifier"}
            self._require_qualifiers(words, section, file, dialect)
            for tree in rest:
                if tree.data == "declaration":
                    self._declare(tree, kind, words, members, file, dialect)
        return members

    def _require_qualifiers(
        self, words: set[str], tree: Node, file: str, dialect: TextDialect
    ) -> None:
        if dialect is TextDialect.COMMON and words & {"PERSISTENT"}:
            raise refused(
                TextPlace.of(file, tree), tr("PERSISTENT does not belong to the common subset")
            )

    def _declare(
        self,
        tree: Node,
        kind: str,
        words: set[str],
        members: dict[str, TextVariable],
        file: str,
        dialect: TextDialect,
    ) -> None:
        names, address, of_tree, first = tree.children
        if address is not None and dialect is TextDialect.COMMON:
            raise refused(TextPlace.of(file, tree), tr("addresses appear in the glue only"))
        of = self.type_of(of_tree, file, dialect)
        instances = isinstance(of, ArrayType) and isinstance(of.element, BlockType)
        if dialect is TextDialect.COMMON and (
            instances or (kind == "var_in_out" and isinstance(of, BlockType))
        ):
            raise refused(
                TextPlace.of(file, tree),
                tr("not every compiler takes instances in arrays or as VAR_IN_OUT"),
            )
        for name in names.children:
            low = require_name(name, file, dialect)
            if low in members:
                raise refused(TextPlace.of(file, name), tr("{name} appears twice", name=low))
            variable = self._variable(low, of, len(members), first, file, dialect)
            variable.kind, variable.retained = kind, "RETAIN" in words
            variable.constant = "CONSTANT" in words
            members[low] = variable

    def _variable(
        self, name: str, of: DataType, slot: int, first: Node, file: str, dialect: TextDialect
    ) -> TextVariable:
        variable = TextVariable(name, of, slot)
        if first is not None:
            if first.data == "initial_members" and dialect is TextDialect.COMMON:
                raise refused(
                    TextPlace.of(file, first),
                    tr("initial values of members appear in the glue only"),
                )
            translator = ExpressionTranslator(self.scope(file, dialect, {}))
            variable.first = initial_value(first, of, translator)
        return variable

    def _array(self, tree: Node, file: str, dialect: TextDialect) -> DataType:
        *spans, of_tree = tree.children
        place = TextPlace.of(file, tree)
        bounds = []
        for span in spans:
            low, high = (bound_value(bound) for bound in span.children)
            if low > high:
                raise refused(place, tr("the bounds of the array are the wrong way round"))
            bounds.append((low, high))
        element = self.type_of(of_tree, file, dialect)
        if isinstance(element, ArrayType):
            raise refused(place, tr("write [a..b, c..d] instead of an array of arrays"))
        return ArrayType(tuple(bounds), element)


def retained_scalars(of: DataType) -> bool:
    """Return whether a type can be kept in a file: scalars all the way down."""
    if isinstance(of, ArrayType):
        return retained_scalars(of.element)
    if isinstance(of, StructType):
        return all(retained_scalars(member.type) for member in of.members.values())
    return isinstance(of, ScalarType)
