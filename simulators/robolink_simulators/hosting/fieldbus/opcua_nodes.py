"""The nodes of a simulated OPC UA server: those of the standard, and the variables of a PLC."""

import copy
import gc
import threading
from collections.abc import Callable, Iterable, Iterator, MutableMapping
from dataclasses import replace
from functools import cache
from typing import Any, Final

from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.server.address_space import (
    AddressSpace,
    AttributeValue,
    NodeData,
    NodeManagementService,
    ViewService,
)
from asyncua.ua.ua_binary import extensionobject_to_binary, nodeid_from_binary, pack_uatype
from asyncua.ua.ua_binary import unpack_uatype as unpacked

from robolink_simulators.hosting.fieldbus.opcua_symbols import (
    PublishedSymbols,
    Symbol,
    SymbolValue,
)

NAMESPACES: Final = (
    "http://opcfoundation.org/UA/",
    "urn:robolink:simulator",
    "http://opcfoundation.org/UA/DI/",
    "http://PLCopen.org/OpcUa/IEC61131-3/",
    "CODESYSSPV3/3S/IecVarAccess",
)
"""The last one, as number 4, is where CODESYS has its variables (field reports); number 1 is the
server's own.
"""

SAMPLE_S: Final = 0.05
"""Interval in seconds at which watched variables are looked at."""

_VARIABLES: Final = 4
_VALUE: Final = ua.AttributeIds.Value


class StandardNodes:
    """The 6,000 nodes of the standard; each is made when it is first asked for.

    A server and its clients ask for a tenth of them, and asyncua would take ten times as long to
    make all. They are nine megabytes of source: whoever serves nothing does not import those.
    """

    def __init__(self) -> None:
        from asyncua.server.standard_address_space import standard_address_space

        self._items: dict[ua.NodeId, ua.AddNodesItem] = {}
        self._references: dict[ua.NodeId, dict[tuple[ua.NodeId, ua.NodeId], bool]] = {}
        self._made: dict[ua.NodeId, NodeData] = {}
        collected = gc.isenabled()
        gc.disable()  # it would take as long again as all that is kept here, which stays
        try:
            standard_address_space.fill_address_space(self)
        finally:
            if collected:
                gc.enable()

    def try_add_nodes(self, items: Iterable[ua.AddNodesItem], *, check: bool) -> tuple[()]:  # noqa: ARG002 - as asyncua calls it
        """Keep what nodes are made of; none is refused."""
        for item in items:
            number, parent = item.RequestedNewNodeId, item.ParentNodeId
            self._items[number] = item
            if not parent.is_null():
                self._refer(parent, item.ReferenceTypeId, number, True)
        return ()

    def try_add_references(self, references: Iterable[ua.AddReferencesItem]) -> tuple[()]:
        """Keep references; none is refused."""
        for one in references:
            self._refer(one.SourceNodeId, one.ReferenceTypeId, one.TargetNodeId, one.IsForward)
        return ()

    def __contains__(self, number: object) -> bool:
        return number in self._items

    def __iter__(self) -> Iterator[ua.NodeId]:
        return iter(self._items)

    def __getitem__(self, number: ua.NodeId) -> NodeData:
        if (node := self._made.get(number)) is None:
            node = self._made[number] = self._make(self._items[number])
        return node

    def _make(self, item: ua.AddNodesItem) -> NodeData:
        space, number = AddressSpace(), item.RequestedNewNodeId
        alone = replace(item, ParentNodeId=ua.NodeId(), TypeDefinition=ua.NodeId())
        list(NodeManagementService(space).try_add_nodes([alone], check=False))
        node = space[number]
        node.references = [
            self._described(*one, forward) for one, forward in self._references[number].items()
        ]
        return node

    def _refer(self, source: ua.NodeId, kind: ua.NodeId, target: ua.NodeId, forward: bool) -> None:
        self._references.setdefault(source, {}).setdefault((kind, target), forward)

    def _described(
        self, kind: ua.NodeId, target: ua.NodeId, forward: bool
    ) -> ua.ReferenceDescription:
        item = self._items[target]
        return ua.ReferenceDescription(
            ReferenceTypeId=kind,
            IsForward=forward,
            NodeId=target,
            BrowseName=item.BrowseName,
            DisplayName=item.NodeAttributes.DisplayName,
            NodeClass=item.NodeClass,
            TypeDefinition=item.TypeDefinition,
        )


_standard_nodes: Final = cache(StandardNodes)
_FILLING: Final = threading.Lock()


class OwnNodes(MutableMapping[ua.NodeId, NodeData]):
    """The nodes of one server over the standard ones, which servers of a process share.

    A standard node that is asked for is copied first, since a server writes into some of them.
    """

    def __init__(self) -> None:
        with _FILLING:
            self._standard = _standard_nodes()
        self._own: dict[ua.NodeId, NodeData] = {}

    def __getitem__(self, number: ua.NodeId) -> NodeData:
        if (node := self._own.get(number)) is None:
            node = self._own[number] = _copied(self._standard[number])
        return node

    def __setitem__(self, number: ua.NodeId, node: NodeData) -> None:
        self._own[number] = node

    def __delitem__(self, number: ua.NodeId) -> None:
        del self._own[number]

    def __contains__(self, number: object) -> bool:
        return number in self._own or number in self._standard

    def __iter__(self) -> Iterator[ua.NodeId]:
        yield from self._own
        yield from (number for number in self._standard if number not in self._own)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def _copied(standard: NodeData) -> NodeData:
    node = NodeData(standard.nodeid)
    node.references = list(standard.references)
    for attribute, held in standard.attributes.items():
        value = copy.deepcopy(held.value) if attribute == _VALUE else held.value
        node.attributes[attribute] = AttributeValue(value)
    return node


class Views(ViewService):
    """Answers clients that browse; looks for subtypes of references once, since none are added."""

    def __init__(self, space: AddressSpace) -> None:
        super().__init__(space)
        self._subtypes: dict[ua.NodeId, frozenset[ua.NodeId]] = {}

    def _get_sub_ref(self, ref: ua.NodeId) -> frozenset[ua.NodeId]:
        if (found := self._subtypes.get(ref)) is None:
            found = self._subtypes[ref] = frozenset(super()._get_sub_ref(ref))
        return found


Shown = Callable[[ua.NodeId, Any], ua.DataValue]
"""Returns the value of a variable when a node is read, as asyncua asks for it."""


class SymbolTree:
    """A PLC's variables among the nodes of a server, where a CODESYS runtime has them.

    Objects > DeviceSet > device > Resources > Application > GlobalVars > list > variable; the form
    of the numbers of variables is that of field reports, those of folders are assumed.

    Args:
        space: The nodes of the server.
        published: The variables.
        own_uri: What names the server.
        shown: Returns the value of a variable.

    Attributes:
        symbols: The variables by the numbers of their nodes.
    """

    def __init__(
        self, space: AddressSpace, published: PublishedSymbols, own_uri: str, shown: Shown
    ) -> None:
        self._service = NodeManagementService(space)
        self._encodings: dict[Symbol, ua.NodeId] = {}
        self.symbols: dict[ua.NodeId, Symbol] = {}
        names = [NAMESPACES[0], own_uri, *NAMESPACES[2:]]
        uris = space[ua.NodeId(ua.ObjectIds.Server_NamespaceArray)].attributes[_VALUE]
        uris.value = ua.DataValue(ua.Variant(names, ua.VariantType.String))
        device = published.device
        application = f"{device}.Application"
        parent = ua.NodeId(ua.ObjectIds.ObjectsFolder)
        for name, number in (
            ("DeviceSet", "|obj|DeviceSet"),
            (device, f"|plc|{device}"),
            ("Resources", f"|res|{device}.Resources"),
            ("Application", f"|appo|{application}"),
            ("GlobalVars", f"|gvls|{application}.GlobalVars"),
        ):
            parent = self._add(_folder(parent, name, number))
        lists: dict[str, ua.NodeId] = {}
        for symbol in published.symbols:
            name = symbol.variables
            if name not in lists:
                lists[name] = self._add(_folder(parent, name, f"|gvl|{application}.{name}"))
            kind = self._structure(symbol) if symbol.fields else _kind(symbol.kind).value
            data_type = kind if symbol.fields else ua.NodeId(kind)
            number = self._add(_variable(lists[name], application, symbol, data_type))
            self.symbols[number] = symbol
            space[number].attributes[_VALUE].value_callback = shown

    def variant(self, symbol: Symbol, value: Any, kind: str = "") -> ua.Variant:  # noqa: ANN401 - as the variable has it
        """Return a value as it is sent, as one of another type if a kind is given."""
        if symbol.fields:
            body = b"".join(
                pack_uatype(_kind(of), one)
                for (_, of), one in zip(symbol.fields, value, strict=False)
            )
            held = ua.ExtensionObject(TypeId=self._encodings[symbol], Body=body)
            return ua.Variant(held, ua.VariantType.ExtensionObject)
        held = list(value) if isinstance(value, tuple) else value
        return ua.Variant(held, _kind(kind or symbol.kind))

    def taken(self, symbol: Symbol, sent: ua.Variant) -> SymbolValue | None:
        """Return what a client sent for a variable, ``None`` if it is of another type or length."""
        if symbol.fields:
            return self._taken_apart(symbol, sent)
        if sent.VariantType is not _kind(symbol.kind):
            return None
        if symbol.length is None:
            held: SymbolValue = sent.Value
            return None if isinstance(held, list) else held
        whole = isinstance(sent.Value, list) and len(sent.Value) == symbol.length
        return tuple(sent.Value) if whole else None

    def _taken_apart(self, symbol: Symbol, sent: ua.Variant) -> SymbolValue | None:
        """Return the fields of a structure; asyncua makes a class of those that a client knows."""
        if sent.VariantType is not ua.VariantType.ExtensionObject or isinstance(sent.Value, list):
            return None
        data = Buffer(extensionobject_to_binary(sent.Value))
        if nodeid_from_binary(data) != self._encodings[symbol]:
            return None
        data.skip(5)  # the form of the body, and its length
        kinds = [_kind(of) for _, of in symbol.fields]
        try:
            values = tuple(unpacked(kind, data) for kind in kinds)
        except Exception:
            return None
        return None if len(data) else values

    def _structure(self, symbol: Symbol) -> ua.NodeId:
        """Add the type of a structure, with the definition that clients take it apart by."""
        name = f"ST_{symbol.name}"
        encoding = ua.NodeId(f"|enc|{symbol.path}", _VARIABLES)
        self._encodings[symbol] = encoding
        fields = [
            ua.StructureField(
                Name=field,
                DataType=ua.NodeId(_kind(of).value),
                ValueRank=ua.ValueRank.Scalar,
                IsOptional=False,
            )
            for field, of in symbol.fields
        ]
        of_all = ua.NodeId(ua.ObjectIds.Structure)
        definition = ua.StructureDefinition(
            DefaultEncodingId=encoding,
            BaseDataType=of_all,
            StructureType=ua.StructureType.Structure,
            Fields=fields,
        )
        item = _item(of_all, name, f"|type|{symbol.path}")
        item.NodeClass = ua.NodeClass.DataType
        item.ReferenceTypeId = ua.NodeId(ua.ObjectIds.HasSubtype)
        item.NodeAttributes = ua.DataTypeAttributes(
            DisplayName=ua.LocalizedText(name), DataTypeDefinition=definition
        )
        number = self._add(item)
        coded = _item(number, "Default Binary", f"|enc|{symbol.path}")
        coded.NodeClass = ua.NodeClass.Object
        coded.ReferenceTypeId = ua.NodeId(ua.ObjectIds.HasEncoding)
        coded.TypeDefinition = ua.NodeId(ua.ObjectIds.DataTypeEncodingType)
        coded.NodeAttributes = ua.ObjectAttributes(DisplayName=ua.LocalizedText("Default Binary"))
        self._add(coded)
        return number

    def _add(self, item: ua.AddNodesItem) -> ua.NodeId:
        (added,) = self._service.add_nodes([item])
        added.StatusCode.check()
        return added.AddedNodeId


def _kind(name: str) -> ua.VariantType:
    return ua.VariantType[name]


def _item(parent: ua.NodeId, name: str, number: str) -> ua.AddNodesItem:
    item = ua.AddNodesItem()
    item.ParentNodeId = parent
    given = number.startswith(("ns=", "i=", "s=", "g=", "b="))
    item.RequestedNewNodeId = (
        ua.NodeId.from_string(number) if given else ua.NodeId(number, _VARIABLES)
    )
    item.BrowseName = ua.QualifiedName(name, _VARIABLES)
    return item


def _folder(parent: ua.NodeId, name: str, number: str) -> ua.AddNodesItem:
    item = _item(parent, name, number)
    item.NodeClass = ua.NodeClass.Object
    item.ReferenceTypeId = ua.NodeId(ua.ObjectIds.Organizes)
    item.TypeDefinition = ua.NodeId(ua.ObjectIds.FolderType)
    item.NodeAttributes = ua.ObjectAttributes(DisplayName=ua.LocalizedText(name), EventNotifier=0)
    return item


def _variable(
    parent: ua.NodeId, application: str, symbol: Symbol, data_type: ua.NodeId
) -> ua.AddNodesItem:
    item = _item(parent, symbol.name, symbol.node or f"|var|{application}.{symbol.path}")
    item.NodeClass = ua.NodeClass.Variable
    item.ReferenceTypeId = ua.NodeId(ua.ObjectIds.HasComponent)
    item.TypeDefinition = ua.NodeId(ua.ObjectIds.BaseDataVariableType)
    access = ua.AccessLevel.CurrentRead.mask
    if symbol.writable:
        access |= ua.AccessLevel.CurrentWrite.mask
    item.NodeAttributes = ua.VariableAttributes(
        DisplayName=ua.LocalizedText(symbol.name),
        DataType=data_type,
        Value=ua.Variant(None, ua.VariantType.Null),
        ValueRank=ua.ValueRank.Scalar if symbol.length is None else ua.ValueRank.OneDimension,
        ArrayDimensions=None if symbol.length is None else [symbol.length],
        AccessLevel=access,
        UserAccessLevel=access,
        MinimumSamplingInterval=SAMPLE_S * 1000,
        Historizing=False,
    )
    return item
