"""What a server has: its nodes by id and by way, and the types of their values.

A node is named by its id, ``ns=4;s=|var|PLC.Application.GVL.aTool1`` or ``i=2258``, or by its way
from Objects, ``/DeviceSet/PLC/Resources/Application/GlobalVars/GVL/aTool1``. A step of a way is a
browse name, with its namespace in front where that is needed (``4:GVL``); ``*`` is any.

Source: OPC 10000-4, 5.8 (browse); OPC 10000-3, 5.6 (variables).
"""

import re
from dataclasses import dataclass, replace
from typing import Any, Final

from asyncua import ua

from robolink.errors import ConfigError, RejectedError
from robolink.messages import tr
from robolink.timing import Deadline
from robolink.transport.opcua import errors as errors
from robolink.transport.opcua.channel import status_of
from robolink.transport.opcua.session import OpcuaSession
from robolink.transport.opcua.structures import (
    STRUCTURE,
    FieldFacts,
    StructureType,
    fields_of,
    type_ids,
)
from robolink.transport.opcua.values import decoded, encoded, shape

_ID: Final = re.compile(r"(?:ns=(?P<ns>\d+);)?(?P<kind>[isgb])=(?P<name>.+)", re.DOTALL)
_STEP: Final = re.compile(r"(?:(?P<ns>\d+):)?(?P<name>.+)", re.DOTALL)
MOST_BROWSED: Final = 10_000
"""Most references of one node that are looked at."""
_ASKED: Final = (
    ua.AttributeIds.NodeClass,
    ua.AttributeIds.BrowseName,
    ua.AttributeIds.DataType,
    ua.AttributeIds.AccessLevel,
    ua.AttributeIds.UserAccessLevel,
    ua.AttributeIds.Value,
)
_BROWSE_NAME, _DATA_TYPE, _ACCESS, _USER_ACCESS = range(1, 5)
"""Places of their answers."""
_LAST_BUILT_IN: Final = 25
_DEEPEST: Final = 8
"""Most levels of structures within structures."""
_NODES_AT_ONCE: Final = 100 // len(_ASKED)
"""Nodes described in one request: a CODESYS server reads 100 attributes at once
(docs/reference/mailbox.md)."""
_READ, _WRITE = 1, 2
"""Bits of an access level (OPC 10000-3, 8.57)."""


@dataclass(frozen=True, slots=True)
class NodeFacts:
    """What a server says of one node.

    Attributes:
        node: As it was asked for.
        id: Its id, in one spelling.
        name: Its browse name, without the namespace.
        kind: Built-in type of the value, as OPC UA calls it (``UInt16``, ``Float``, ``Double``,
            ``Boolean``, ...), ``Structure``, or empty for a node without a value.
        lengths: Of an array, one for each dimension; empty for a single value.
        fields: Of a structure, in its order; empty where the server does not define it.
        readable: Whether this session may read the value.
        writable: Whether it may write it.
    """

    node: str
    id: str
    name: str
    kind: str = ""
    lengths: tuple[int, ...] = ()
    fields: tuple[FieldFacts, ...] = ()
    readable: bool = False
    writable: bool = False

    @property
    def type_name(self) -> str:
        """The type for display, for example ``UInt16[64]``."""
        return shape(self.kind, self.lengths)


class AddressSpace:
    """Finds and describes nodes. The caller holds the lock of the exchange.

    Args:
        session: Activated; owned by the caller.
        identity: Names the far end in errors.
    """

    def __init__(self, session: OpcuaSession, identity: str) -> None:
        self._session = session
        self._identity = identity
        self._types: dict[str, ua.VariantType | StructureType | None] = {}
        self._type_of: dict[str, str] = {}

    def ask(
        self,
        request: Any,  # noqa: ANN401 - asyncua's requests share no class
        answer: Any,  # noqa: ANN401 - nor its answers
        deadline: Deadline,
        told: str,
        count: int,
        *,
        write: bool = False,
    ) -> list[Any]:
        """Return the results of a request, of which there have to be ``count``."""
        answered = self._session.ask(request, answer, deadline, told=told, write=write)
        results = getattr(answered, "Parameters", answered).Results  # below one, of BrowseNext
        if len(results or ()) != count:
            raise errors.unintelligible(self._identity, told)
        return list(results)

    def taken(
        self, node: str, variant: ua.Variant | None
    ) -> tuple[str, tuple[int, ...], tuple[FieldFacts, ...], object]:
        """Return kind, lengths, fields and value of what the server sent for a node."""
        kind, lengths, value = decoded(variant)
        if kind != "ExtensionObject":
            return kind, lengths, (), value
        own = self._types.get(self._type_of.get(node, ""))
        if not isinstance(own, StructureType) or len(lengths) > 1:
            return STRUCTURE, lengths, (), value
        try:
            taken = [own.decoded(one) for one in (value if lengths else [value])]
        except Exception as error:  # what a parser raises on bytes from anywhere
            raise errors.unintelligible(self._identity, f"{node}: {error}") from error
        met = [one for one in taken if one is not None]
        if len(met) != len(taken) or any(fields != met[0][0] for fields, _ in met):
            return STRUCTURE, (-1,), (), value
        values = [one for _, one in met]
        return STRUCTURE, lengths, met[0][0] if met else (), values if lengths else values[0]

    def variant(self, facts: NodeFacts, value: object) -> ua.Variant | None:
        """Return what is written; ``None`` where the value does not fit the node."""
        if facts.kind != STRUCTURE:
            return encoded(facts.kind, facts.lengths, value)
        own = self._types.get(self._type_of.get(facts.id, ""))
        values = value if facts.lengths else [value]
        if (
            not isinstance(own, StructureType)
            or not isinstance(values, list | tuple)
            or (facts.lengths and (len(values),) != facts.lengths)
        ):
            return None
        made = [own.encoded(facts.fields, one) for one in values]
        if any(one is None for one in made):
            return None
        return ua.Variant(
            made if facts.lengths else made[0],
            ua.VariantType.ExtensionObject,
            is_array=bool(facts.lengths),
        )

    def _learn_type(self, node: ua.NodeId, deadline: Deadline, depth: int = 0) -> None:
        """Find out what a data type is, and keep it: built in, a structure, or nothing known."""
        name = spelled(node)
        if name in self._types:
            return
        if node.NamespaceIndex == 0 and 1 <= node.Identifier <= _LAST_BUILT_IN:
            self._types[name] = ua.VariantType(node.Identifier)
            return
        self._types[name] = None  # also while it is looked at: one that holds itself is none
        request = ua.ReadRequest()
        request.Parameters.TimestampsToReturn = ua.TimestampsToReturn.Neither
        request.Parameters.NodesToRead = [
            ua.ReadValueId(NodeId=node, AttributeId=ua.AttributeIds.DataTypeDefinition)
        ]
        told = tr("read the definition of {node}", node=name)
        (found,) = self.ask(request, ua.ReadResponse, deadline, told, 1)
        definition = _given(found, ua.StructureDefinition | ua.EnumDefinition)
        if isinstance(definition, ua.EnumDefinition):
            self._types[name] = ua.VariantType.Int32
        elif depth < _DEEPEST:
            for one in type_ids(definition):
                self._learn_type(one, deadline, depth + 1)
            self._types[name] = fields_of(definition, self._types)

    def described(
        self, ids: list[ua.NodeId], deadline: Deadline, *, gaps: bool = False
    ) -> tuple[NodeFacts, ...]:
        """Return what the server says of nodes, in their order.

        Args:
            ids: The nodes.
            deadline: Until when.
            gaps: Whether those of which it says nothing are left out, and those whose value it
                refuses count as not readable, instead of raising.

        Raises:
            RejectedError: The server does not know a node, or has no value for it now.
        """
        described: list[NodeFacts] = []
        for start in range(0, len(ids), _NODES_AT_ONCE):
            asked = ids[start : start + _NODES_AT_ONCE]
            request = ua.ReadRequest()
            request.Parameters.TimestampsToReturn = ua.TimestampsToReturn.Neither
            request.Parameters.NodesToRead = [
                ua.ReadValueId(NodeId=one, AttributeId=attribute)
                for one in asked
                for attribute in _ASKED
            ]
            told = tr("describe {node}", node=", ".join(map(spelled, asked)))
            count = len(request.Parameters.NodesToRead)
            found = self.ask(request, ua.ReadResponse, deadline, told, count)
            for one, place in zip(asked, range(0, count, len(_ASKED)), strict=True):
                answers = found[place : place + len(_ASKED)]
                if gaps and _given(answers[0], int) is None:
                    continue
                data_type = _given(answers[_DATA_TYPE], ua.NodeId)
                if data_type is not None and _is_structure(answers[-1]):
                    self._type_of[spelled(one)] = spelled(data_type)
                    self._learn_type(data_type, deadline)
                described.append(self._facts_of(one, answers, gaps=gaps))
        return tuple(described)

    def _require_good(self, name: str, found: ua.DataValue) -> None:
        if found.StatusCode is not None and not found.StatusCode.is_good():
            raise errors.refused_node(
                self._identity, name, status_of(found.StatusCode), write=False
            )

    def _facts_of(self, node: ua.NodeId, found: list[ua.DataValue], *, gaps: bool) -> NodeFacts:
        name_of = spelled(node)
        node_class = found[0]
        self._require_good(name_of, node_class)
        name = _given(found[_BROWSE_NAME], ua.QualifiedName)
        facts = NodeFacts(name_of, name_of, str(name.Name) if name else "")
        if _given(node_class, int) != ua.NodeClass.Variable:
            return facts
        access = _given(found[_ACCESS], int) or 0
        user_access = _given(found[_USER_ACCESS], int)
        allowed = access if user_access is None else access & user_access
        if not gaps and allowed & _READ:
            self._require_good(name_of, found[-1])
        if not allowed & _READ or _given(found[-1], object) is None:
            return facts
        kind, lengths, fields, _ = self.taken(name_of, found[-1].Value)
        return replace(
            facts,
            kind=kind,
            lengths=lengths,
            fields=fields,
            readable=True,
            writable=bool(allowed & _WRITE),
        )

    def resolved(self, node: str, deadline: Deadline) -> ua.NodeId:
        """Return the id of the one node that is named by its id or its way.

        Raises:
            ConfigError: It is no name, or several nodes have it.
            RejectedError: No node has it.
        """
        if not node.startswith("/"):
            return node_id(node)
        found = self.at(node, deadline)
        if not found:
            raise RejectedError(
                tr("{identity} has no {node}.", identity=self._identity, node=node),
                remedy=tr("Compare the name with those that the server has."),
            )
        if len(found) > 1:
            raise ConfigError(
                tr(
                    "{node} of {identity} may be any of: {names}.",
                    node=node,
                    identity=self._identity,
                    names=", ".join(map(spelled, found)),
                ),
                remedy=tr("Name the one that is meant by its id."),
                controller=self._identity,
            )
        return found[0]

    def at(self, path: str, deadline: Deadline) -> list[ua.NodeId]:
        """Return the ids of all nodes at a way from Objects."""
        found = [ua.NodeId(ua.ObjectIds.ObjectsFolder)]
        for step in path.strip("/").split("/"):
            wanted = _STEP.fullmatch(step)
            if wanted is None:
                raise ConfigError(
                    tr("{path} names no node.", path=path),
                    remedy=tr("Write for example /DeviceSet/PLC/Resources, without a gap."),
                )
            namespace, name = wanted["ns"], wanted["name"]
            found = [
                local(reference.NodeId)
                for above in found
                for reference in self.below(above, deadline, MOST_BROWSED)
                if name in ("*", reference.BrowseName.Name)
                and namespace in (None, str(reference.BrowseName.NamespaceIndex))
            ]
            found = list(dict.fromkeys(found))
        return found

    def below(
        self, node: ua.NodeId, deadline: Deadline, most: int
    ) -> list[ua.ReferenceDescription]:
        """Return the first references from a node to those below it."""
        request = ua.BrowseRequest()
        request.Parameters.RequestedMaxReferencesPerNode = most
        request.Parameters.NodesToBrowse = [
            ua.BrowseDescription(
                NodeId=node,
                BrowseDirection=ua.BrowseDirection.Forward,
                ReferenceTypeId=ua.NodeId(ua.ObjectIds.HierarchicalReferences),
                IncludeSubtypes=True,
                NodeClassMask=0,
                ResultMask=ua.BrowseResultMask.All,
            )
        ]
        told = tr("list what is below {node}", node=spelled(node))
        (result,) = self.ask(request, ua.BrowseResponse, deadline, told, 1)
        references: list[ua.ReferenceDescription] = []
        while True:
            if not result.StatusCode.is_good():
                raise errors.refused_node(
                    self._identity, spelled(node), status_of(result.StatusCode), write=False
                )
            references += result.References or ()
            if not result.ContinuationPoint:
                return references[:most]
            rest = ua.BrowseNextRequest()
            rest.Parameters.ReleaseContinuationPoints = len(references) >= most
            rest.Parameters.ContinuationPoints = [result.ContinuationPoint]
            if rest.Parameters.ReleaseContinuationPoints:
                self._session.ask(rest, ua.BrowseNextResponse, deadline, told=told)
                return references[:most]
            (result,) = self.ask(rest, ua.BrowseNextResponse, deadline, told, 1)


def _is_structure(found: ua.DataValue) -> bool:
    given = found.Value
    return given is not None and bool(given.VariantType == ua.VariantType.ExtensionObject)


def _given(found: ua.DataValue, kind: Any) -> Any:  # noqa: ANN401 - an attribute may be anything
    """Return an attribute; ``None`` where the server gives none, or something of another kind."""
    if found.StatusCode is not None and not found.StatusCode.is_good():
        return None
    value = found.Value.Value if found.Value is not None else None
    return value if isinstance(value, kind) else None


def node_id(text: str) -> ua.NodeId:
    """Return an id. A name may hold anything, semicolons too.

    Raises:
        ConfigError: It is none.
    """
    parts = _ID.fullmatch(text)
    try:
        if parts is not None:
            namespace = parts["ns"] or "0"
            if parts["kind"] == "s":
                return ua.NodeId(parts["name"], ua.Int16(int(namespace)), ua.NodeIdType.String)
            if parts["kind"] == "i":
                return ua.NodeId(
                    int(parts["name"]), ua.Int16(int(namespace)), ua.NodeIdType.Numeric
                )
            return ua.NodeId.from_string(text)
    except (ValueError, ua.UaError):
        pass
    raise ConfigError(
        tr("{text!r} names no node.", text=text),
        remedy=tr(
            "Write its id, for example ns=4;s=|var|PLC.Application.GVL.aTool1, or its way from "
            "Objects, for example /DeviceSet/PLC."
        ),
    )


def spelled(node: ua.NodeId) -> str:
    """Return an id in its one spelling."""
    text = node.to_string()
    return str(text)


def local(node: Any) -> ua.NodeId:  # noqa: ANN401 - asyncua's ids share no class
    """Return the id of a node of this server from one that may name another."""
    return ua.NodeId(node.Identifier, node.NamespaceIndex, node.NodeIdType)
