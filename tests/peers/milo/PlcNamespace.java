import com.google.gson.JsonElement;
import java.util.Arrays;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import java.util.function.Consumer;
import java.util.function.Supplier;
import org.eclipse.milo.opcua.sdk.core.AccessLevel;
import org.eclipse.milo.opcua.sdk.core.Reference;
import org.eclipse.milo.opcua.sdk.core.ValueRanks;
import org.eclipse.milo.opcua.sdk.server.OpcUaServer;
import org.eclipse.milo.opcua.sdk.server.api.DataItem;
import org.eclipse.milo.opcua.sdk.server.api.ManagedNamespaceWithLifecycle;
import org.eclipse.milo.opcua.sdk.server.api.MonitoredItem;
import org.eclipse.milo.opcua.sdk.server.nodes.UaDataTypeNode;
import org.eclipse.milo.opcua.sdk.server.nodes.UaFolderNode;
import org.eclipse.milo.opcua.sdk.server.nodes.UaVariableNode;
import org.eclipse.milo.opcua.sdk.server.nodes.UaVariableNode.UaVariableNodeBuilder;
import org.eclipse.milo.opcua.sdk.server.nodes.filters.AttributeFilters;
import org.eclipse.milo.opcua.sdk.server.util.SubscriptionModel;
import org.eclipse.milo.opcua.stack.core.BuiltinDataType;
import org.eclipse.milo.opcua.stack.core.Identifiers;
import org.eclipse.milo.opcua.stack.core.types.builtin.ByteString;
import org.eclipse.milo.opcua.stack.core.types.builtin.DataValue;
import org.eclipse.milo.opcua.stack.core.types.builtin.ExtensionObject;
import org.eclipse.milo.opcua.stack.core.types.builtin.LocalizedText;
import org.eclipse.milo.opcua.stack.core.types.builtin.NodeId;
import org.eclipse.milo.opcua.stack.core.types.builtin.Variant;
import org.eclipse.milo.opcua.stack.core.types.builtin.unsigned.UInteger;
import org.eclipse.milo.opcua.stack.core.types.builtin.unsigned.UShort;
import org.eclipse.milo.opcua.stack.core.types.builtin.unsigned.Unsigned;

/** The variables of a PLC where a CODESYS runtime has them: a mailbox, and tools of the machine. */
final class PlcNamespace extends ManagedNamespaceWithLifecycle {
  private static final String URI = "CODESYSSPV3/3S/IecVarAccess";

  private final SubscriptionModel subscriptions;
  private final ModbusPlc plc;
  private final Map<String, NodeId> lists = new HashMap<>();
  private final Map<String, Object> values = new HashMap<>();
  private final Map<String, String> types = new HashMap<>();
  private NodeId globals = Identifiers.ObjectsFolder;
  private int cycles;

  PlcNamespace(OpcUaServer server, ModbusPlc plc) {
    super(server, URI);
    this.plc = plc;
    subscriptions = new SubscriptionModel(server, this);
    getLifecycleManager().addLifecycle(subscriptions);
    getLifecycleManager().addStartupTask(this::fill);
  }

  /** Changes a variable of the machine; those that it counts itself stay as they are. */
  synchronized void set(String name, JsonElement value) {
    if (values.containsKey(name)) {
      values.put(name, JsonLines.variant(types.get(name), value).getValue());
    }
  }

  private synchronized Object value(String name) {
    return values.get(name);
  }

  private void fill() {
    for (String name : List.of("DeviceSet", "Judge", "Resources", "Application", "GlobalVars")) {
      globals = folder(globals, name);
    }
    mailbox();
    machine();
  }

  /** What is read was fetched from the PLC for that; what is written is stored there whole. */
  private void mailbox() {
    variable(
        "RL_Symbols", "response", id("UInt16"), 114, () -> framed(plc.fetched(0, 112, 112)), null);
    variable(
        "RL_Symbols", "slots", id("UInt16"), 544, () -> plc.fetched(112, 544, 3 * 36), null);
    UShort[] none = new UShort[64];
    Arrays.fill(none, Unsigned.ushort(0));
    commanded("command", 0, none);
    commanded("heartbeat", 62, none[0]);
  }

  private void commanded(String name, int address, Object first) {
    values.put(name, first);
    int length = first instanceof UShort[] ? ((UShort[]) first).length : 0;
    variable(
        "RL_Symbols",
        name,
        id("UInt16"),
        length,
        () -> value(name),
        given -> {
          synchronized (this) {
            values.put(name, given);
          }
          JsonLines.say("wrote", name);
          boolean whole = given instanceof UShort[];
          plc.store(address, whole ? (UShort[]) given : new UShort[] {(UShort) given});
        });
  }

  /** Each response has a count of its own at both ends, as in a PLC each cycle has. */
  private synchronized UShort[] framed(UShort[] words) {
    cycles = (cycles + 1) & 0xFFFF;
    UShort[] all = new UShort[words.length + 2];
    System.arraycopy(words, 0, all, 1, words.length);
    all[0] = all[all.length - 1] = Unsigned.ushort(cycles);
    return all;
  }

  private void machine() {
    own("aTool1", "Double", true, new Double[] {12.0, -3.5, -20.0, 15.0, 0.0, 0.0});
    own("aTool2", "Double", true, new Double[] {-12.0, -3.5, -21.0, 0.0, 0.0, 0.0});
    own("aShown", "Double", false, new Double[] {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
    own("aReal", "Float", true, new Float[] {0f, 0f, 0f, 0f, 0f, 0f});
    own("xPermit", "Boolean", true, true);
    variable("GVL", "uiCycle", id("UInt32"), 0, PlcNamespace::cycle, null);
    // Milo 0.6 has no attribute DataTypeDefinition: no client is told what is in a structure.
    NodeId type = newNodeId("|type|ST_Tool");
    UaDataTypeNode shown =
        new UaDataTypeNode(
            getNodeContext(),
            type,
            newQualifiedName("ST_Tool"),
            LocalizedText.english("ST_Tool"),
            LocalizedText.NULL_VALUE,
            Unsigned.uint(0),
            Unsigned.uint(0),
            false);
    getNodeManager().addNode(shown);
    shown.addReference(
        new Reference(type, Identifiers.HasSubtype, Identifiers.Structure.expanded(), false));
    ExtensionObject zeros =
        new ExtensionObject(ByteString.of(new byte[32]), newNodeId("|enc|ST_Tool"));
    own("stTool", type, true, zeros);
  }

  private static UInteger cycle() {
    return Unsigned.uint((System.nanoTime() / 10_000_000L) & 0x7FFFFFFFL);
  }

  private void own(String name, String type, boolean writable, Object value) {
    types.put(name, type);
    own(name, id(type), writable, value);
  }

  private void own(String name, NodeId type, boolean writable, Object value) {
    values.put(name, value);
    int length = value instanceof Object[] ? ((Object[]) value).length : 0;
    Consumer<Object> taken =
        given -> {
          synchronized (this) {
            values.put(name, given);
          }
          JsonLines.say("wrote", name, "value", given);
        };
    variable("GVL", name, type, length, () -> value(name), writable ? taken : null);
  }

  private static NodeId id(String type) {
    return BuiltinDataType.valueOf(type).getNodeId();
  }

  private NodeId folder(NodeId parent, String name) {
    NodeId id = newNodeId("|tree|" + name);
    UaFolderNode folder =
        new UaFolderNode(
            getNodeContext(), id, newQualifiedName(name), LocalizedText.english(name));
    getNodeManager().addNode(folder);
    folder.addReference(new Reference(id, Identifiers.Organizes, parent.expanded(), false));
    return id;
  }

  /** Taken is told of what a client wrote; null where none may write. */
  private void variable(
      String list,
      String name,
      NodeId type,
      int length,
      Supplier<Object> shown,
      Consumer<Object> taken) {
    NodeId parent = lists.computeIfAbsent(list, one -> folder(globals, one));
    NodeId id = newNodeId("|var|Judge.Application." + list + "." + name);
    AccessLevel[] access =
        taken == null
            ? new AccessLevel[] {AccessLevel.CurrentRead}
            : new AccessLevel[] {AccessLevel.CurrentRead, AccessLevel.CurrentWrite};
    UaVariableNodeBuilder builder =
        new UaVariableNodeBuilder(getNodeContext())
            .setNodeId(id)
            .setBrowseName(newQualifiedName(name))
            .setDisplayName(LocalizedText.english(name))
            .setDataType(type)
            .setTypeDefinition(Identifiers.BaseDataVariableType)
            .setAccessLevel(access)
            .setUserAccessLevel(access)
            .setMinimumSamplingInterval(20.0)
            .setValueRank(length > 0 ? ValueRanks.OneDimension : ValueRanks.Scalar);
    if (length > 0) {
      builder.setArrayDimensions(new UInteger[] {Unsigned.uint(length)});
    }
    builder.addAttributeFilter(
        AttributeFilters.getValue(context -> new DataValue(new Variant(shown.get()))));
    builder.addAttributeFilter(
        AttributeFilters.setValue(
            (context, given) -> {
              if (taken != null && context.getSession().isPresent()) {
                taken.accept(given.getValue().getValue());
              }
            }));
    UaVariableNode node = builder.build();
    getNodeManager().addNode(node);
    node.addReference(new Reference(id, Identifiers.HasComponent, parent.expanded(), false));
  }

  @Override
  public void onDataItemsCreated(List<DataItem> items) {
    subscriptions.onDataItemsCreated(items);
  }

  @Override
  public void onDataItemsModified(List<DataItem> items) {
    subscriptions.onDataItemsModified(items);
  }

  @Override
  public void onDataItemsDeleted(List<DataItem> items) {
    subscriptions.onDataItemsDeleted(items);
  }

  @Override
  public void onMonitoringModeChanged(List<MonitoredItem> items) {
    subscriptions.onMonitoringModeChanged(items);
  }
}
