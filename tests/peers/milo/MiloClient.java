import com.google.gson.JsonArray;
import com.google.gson.JsonElement;
import com.google.gson.JsonObject;
import com.google.gson.JsonParser;
import java.io.BufferedReader;
import java.io.InputStreamReader;
import java.nio.file.Path;
import java.security.Security;
import java.security.cert.X509Certificate;
import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.TimeUnit;
import org.bouncycastle.jce.provider.BouncyCastleProvider;
import org.eclipse.milo.opcua.sdk.client.OpcUaClient;
import org.eclipse.milo.opcua.sdk.client.api.identity.AnonymousProvider;
import org.eclipse.milo.opcua.sdk.client.api.identity.IdentityProvider;
import org.eclipse.milo.opcua.sdk.client.api.identity.UsernameProvider;
import org.eclipse.milo.opcua.sdk.client.subscriptions.ManagedSubscription;
import org.eclipse.milo.opcua.stack.client.security.DefaultClientCertificateValidator;
import org.eclipse.milo.opcua.stack.core.AttributeId;
import org.eclipse.milo.opcua.stack.core.Identifiers;
import org.eclipse.milo.opcua.stack.core.UaException;
import org.eclipse.milo.opcua.stack.core.security.DefaultTrustListManager;
import org.eclipse.milo.opcua.stack.core.security.SecurityPolicy;
import org.eclipse.milo.opcua.stack.core.security.TrustListManager;
import org.eclipse.milo.opcua.stack.core.types.builtin.DataValue;
import org.eclipse.milo.opcua.stack.core.types.builtin.DateTime;
import org.eclipse.milo.opcua.stack.core.types.builtin.LocalizedText;
import org.eclipse.milo.opcua.stack.core.types.builtin.NodeId;
import org.eclipse.milo.opcua.stack.core.types.builtin.QualifiedName;
import org.eclipse.milo.opcua.stack.core.types.builtin.StatusCode;
import org.eclipse.milo.opcua.stack.core.types.builtin.Variant;
import org.eclipse.milo.opcua.stack.core.types.builtin.unsigned.Unsigned;
import org.eclipse.milo.opcua.stack.core.types.enumerated.BrowseDirection;
import org.eclipse.milo.opcua.stack.core.types.enumerated.BrowseResultMask;
import org.eclipse.milo.opcua.stack.core.types.enumerated.NodeClass;
import org.eclipse.milo.opcua.stack.core.types.enumerated.TimestampsToReturn;
import org.eclipse.milo.opcua.stack.core.types.structured.BrowseDescription;
import org.eclipse.milo.opcua.stack.core.types.structured.ReadValueId;
import org.eclipse.milo.opcua.stack.core.types.structured.ReferenceDescription;
import org.eclipse.milo.opcua.stack.core.types.structured.WriteValue;
import org.eclipse.milo.opcua.stack.core.util.validation.ValidationCheck;

/**
 * An OPC UA client by Eclipse Milo that does what it is told, a JSON object a line, and answers so:
 *
 * <ul>
 *   <li>{"do": "browse", "path": ["DeviceSet", "Device"]}: names of the children
 *   <li>{"do": "read", "nodes": ["ns=4;s=..."]}: status, type and value of each
 *   <li>{"do": "write", "node": "...", "type": "Double", "value": [1, 2], "range": "0:1",
 *       "stamped": true}: the status; the last two may be left out
 *   <li>{"do": "watch", "node": "..."}: the values that a subscription brings, as they come
 * </ul>
 *
 * <p>MiloClient FOLDER URL POLICY [USER PASSWORD]
 */
final class MiloClient {
  private final OpcUaClient client;

  private MiloClient(OpcUaClient client) {
    this.client = client;
  }

  public static void main(String[] arguments) throws Exception {
    Security.addProvider(new BouncyCastleProvider()); // for RSA-PSS
    OpcUaClient client;
    try {
      client = connected(arguments);
    } catch (Exception error) {
      JsonLines.say("refused", told(error));
      System.exit(1);
      return;
    }
    JsonLines.say("connected", arguments[1]);
    MiloClient acting = new MiloClient(client);
    BufferedReader input = new BufferedReader(new InputStreamReader(System.in));
    for (String line = input.readLine(); line != null; line = input.readLine()) {
      JsonObject asked = JsonParser.parseString(line).getAsJsonObject();
      try {
        JsonLines.say("done", acting.done(asked));
      } catch (Exception error) {
        JsonLines.say("failed", told(error));
      }
    }
    client.disconnect().get(5, TimeUnit.SECONDS);
    System.exit(0);
  }

  private static String told(Exception error) {
    return UaException.extractStatusCode(error).map(JsonLines::name).orElse(error.toString());
  }

  private static OpcUaClient connected(String[] arguments) throws Exception {
    SecurityPolicy policy = SecurityPolicy.valueOf(arguments[2]);
    OwnCertificate own = new OwnCertificate("client");
    TrustListManager trusted =
        new DefaultTrustListManager(Path.of(arguments[0], "pki").toFile());
    IdentityProvider user =
        arguments.length > 3
            ? new UsernameProvider(arguments[3], arguments[4])
            : new AnonymousProvider();
    OpcUaClient client =
        OpcUaClient.create(
            arguments[1],
            offered ->
                offered.stream()
                    .filter(one -> one.getSecurityPolicyUri().equals(policy.getUri()))
                    .findFirst(),
            config ->
                config
                    .setApplicationName(LocalizedText.english("Milo"))
                    .setApplicationUri(own.applicationUri)
                    .setKeyPair(own.keys)
                    .setCertificate(own.certificate)
                    .setCertificateChain(new X509Certificate[] {own.certificate})
                    .setCertificateValidator(new Examining(trusted))
                    .setIdentityProvider(user)
                    .setRequestTimeout(Unsigned.uint(10_000))
                    .build());
    client.connect().get(30, TimeUnit.SECONDS);
    return client;
  }

  private JsonElement done(JsonObject asked) throws Exception {
    switch (asked.get("do").getAsString()) {
      case "browse":
        return browsed(asked.getAsJsonArray("path"));
      case "read":
        return read(asked.getAsJsonArray("nodes"));
      case "write":
        return written(asked);
      case "watch":
        return watched(asked.get("node").getAsString());
      default:
        throw new IllegalArgumentException(asked.toString());
    }
  }

  private JsonElement browsed(JsonArray path) throws Exception {
    NodeId node = Identifiers.ObjectsFolder;
    for (JsonElement step : path) {
      NodeId parent = node;
      node =
          below(parent).stream()
              .filter(one -> one.getBrowseName().getName().equals(step.getAsString()))
              .findFirst()
              .flatMap(one -> one.getNodeId().toNodeId(client.getNamespaceTable()))
              .orElseThrow(() -> new IllegalArgumentException("no " + step + " below " + parent));
    }
    JsonArray names = new JsonArray();
    for (ReferenceDescription one : below(node)) {
      names.add(one.getBrowseName().getName());
    }
    return JsonLines.object("node", node.toParseableString(), "children", names);
  }

  private List<ReferenceDescription> below(NodeId node) throws Exception {
    int classes = NodeClass.Object.getValue() | NodeClass.Variable.getValue();
    BrowseDescription asked =
        new BrowseDescription(
            node,
            BrowseDirection.Forward,
            Identifiers.HierarchicalReferences,
            true,
            Unsigned.uint(classes),
            Unsigned.uint(BrowseResultMask.All.getValue()));
    return List.of(client.browse(asked).get().getReferences());
  }

  private JsonElement read(JsonArray nodes) throws Exception {
    List<ReadValueId> asked = new ArrayList<>();
    for (JsonElement node : nodes) {
      asked.add(
          new ReadValueId(
              NodeId.parse(node.getAsString()),
              AttributeId.Value.uid(),
              null,
              QualifiedName.NULL_VALUE));
    }
    JsonArray all = new JsonArray();
    for (DataValue one :
        client.read(0, TimestampsToReturn.Both, asked).get().getResults()) {
      all.add(
          JsonLines.object(
              "status", JsonLines.name(one.getStatusCode()),
              "type", JsonLines.typeOf(one.getValue()),
              "value", one.getValue().getValue()));
    }
    return all;
  }

  private JsonElement written(JsonObject asked) throws Exception {
    Variant value = JsonLines.variant(asked.get("type").getAsString(), asked.get("value"));
    DateTime now = asked.has("stamped") ? DateTime.now() : null;
    WriteValue write =
        new WriteValue(
            NodeId.parse(asked.get("node").getAsString()),
            AttributeId.Value.uid(),
            asked.has("range") ? asked.get("range").getAsString() : null,
            new DataValue(value, null, now, null));
    StatusCode status = client.write(List.of(write)).get().getResults()[0];
    return JsonLines.object("status", JsonLines.name(status));
  }

  private JsonElement watched(String node) throws Exception {
    ManagedSubscription subscription = ManagedSubscription.create(client, 20.0);
    subscription.setDefaultSamplingInterval(20.0);
    subscription.setDefaultQueueSize(Unsigned.uint(10));
    subscription.addDataChangeListener(
        (items, values) -> {
          for (DataValue value : values) {
            JsonLines.say("changed", node, "value", value.getValue().getValue());
          }
        });
    StatusCode status = subscription.createDataItem(NodeId.parse(node)).getStatusCode();
    return JsonLines.object("watched", node, "status", JsonLines.name(status));
  }

  /** Trusts every server, and examines its certificate in every way that Milo knows. */
  private static final class Examining extends DefaultClientCertificateValidator {
    private final TrustListManager trusted;

    Examining(TrustListManager trusted) {
      super(trusted, ValidationCheck.ALL_OPTIONAL_CHECKS);
      this.trusted = trusted;
    }

    @Override
    public void validateCertificateChain(List<X509Certificate> chain) throws UaException {
      trusted.addTrustedCertificate(chain.get(0));
      super.validateCertificateChain(chain);
    }

    @Override
    public void validateCertificateChain(
        List<X509Certificate> chain, String applicationUri, String... validHostNames)
        throws UaException {
      trusted.addTrustedCertificate(chain.get(0));
      super.validateCertificateChain(chain, applicationUri, validHostNames);
    }
  }
}
