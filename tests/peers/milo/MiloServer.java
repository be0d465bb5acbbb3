import com.google.gson.JsonObject;
import com.google.gson.JsonParser;
import java.io.BufferedReader;
import java.io.InputStreamReader;
import java.net.InetAddress;
import java.net.ServerSocket;
import java.nio.file.Path;
import java.security.Security;
import java.security.cert.X509Certificate;
import java.util.ArrayList;
import java.util.LinkedHashSet;
import java.util.List;
import java.util.Set;
import org.bouncycastle.jce.provider.BouncyCastleProvider;
import org.eclipse.milo.opcua.sdk.server.OpcUaServer;
import org.eclipse.milo.opcua.sdk.server.api.config.OpcUaServerConfig;
import org.eclipse.milo.opcua.sdk.server.identity.UsernameIdentityValidator;
import org.eclipse.milo.opcua.stack.core.UaException;
import org.eclipse.milo.opcua.stack.core.security.DefaultCertificateManager;
import org.eclipse.milo.opcua.stack.core.security.DefaultTrustListManager;
import org.eclipse.milo.opcua.stack.core.security.SecurityPolicy;
import org.eclipse.milo.opcua.stack.core.security.TrustListManager;
import org.eclipse.milo.opcua.stack.core.types.builtin.DateTime;
import org.eclipse.milo.opcua.stack.core.types.builtin.LocalizedText;
import org.eclipse.milo.opcua.stack.core.types.enumerated.MessageSecurityMode;
import org.eclipse.milo.opcua.stack.core.types.structured.BuildInfo;
import org.eclipse.milo.opcua.stack.core.util.validation.ValidationCheck;
import org.eclipse.milo.opcua.stack.server.EndpointConfiguration;
import org.eclipse.milo.opcua.stack.server.security.DefaultServerCertificateValidator;

/**
 * An OPC UA server by Eclipse Milo, in the shape of a CODESYS runtime: the arrays of the mailbox,
 * whose words it fetches from and stores in a simulated PLC over Modbus TCP at each request, and
 * the tools of a machine. What is written it prints, a JSON object a line; a line {"set": NAME,
 * "value": ...} on its input changes a variable of the machine.
 *
 * <p>MiloServer FOLDER MODBUS_PORT [USER PASSWORD] [--refuse-certificates] [--port=PORT]
 */
final class MiloServer {
  private static final String NAMESPACES_BEFORE_THE_PLC[] = {
    "http://opcfoundation.org/UA/DI/", "http://PLCopen.org/OpcUa/IEC61131-3/"
  };

  private MiloServer() {}

  public static void main(String[] arguments) throws Exception {
    Security.addProvider(new BouncyCastleProvider()); // for RSA-PSS
    List<String> words = new ArrayList<>(List.of(arguments));
    boolean refuses = words.remove("--refuse-certificates");
    int port = freePort();
    for (String word : List.copyOf(words)) {
      if (word.startsWith("--port=")) {
        port = Integer.parseInt(word.substring("--port=".length()));
        words.remove(word);
      }
    }
    String user = words.size() > 2 ? words.get(2) : null;
    String password = user == null ? null : words.get(3);

    OwnCertificate own = new OwnCertificate("server");
    DefaultTrustListManager trusted =
        new DefaultTrustListManager(Path.of(words.get(0), "pki").toFile());
    OpcUaServerConfig config =
        OpcUaServerConfig.builder()
            .setApplicationUri(own.applicationUri)
            .setProductUri("urn:judge:milo")
            .setApplicationName(LocalizedText.english("Milo"))
            .setBuildInfo(new BuildInfo("urn:judge:milo", "", "", "", "", DateTime.now()))
            .setEndpoints(endpoints(own, port, user != null))
            .setCertificateManager(new DefaultCertificateManager(own.keys, own.certificate))
            .setTrustListManager(trusted)
            .setCertificateValidator(new Examining(trusted, refuses))
            .setIdentityValidator(
                new UsernameIdentityValidator(
                    user == null,
                    given ->
                        given.getUsername().equals(user) && given.getPassword().equals(password)))
            .build();
    OpcUaServer server = new OpcUaServer(config);
    for (String uri : NAMESPACES_BEFORE_THE_PLC) {
      server.getNamespaceTable().addUri(uri);
    }
    PlcNamespace plc =
        new PlcNamespace(server, new ModbusPlc(Integer.parseInt(words.get(1))));
    plc.startup();
    server.startup().get();
    JsonLines.say("listening", JsonLines.object("port", port, "sha256", own.sha256()));

    BufferedReader input = new BufferedReader(new InputStreamReader(System.in));
    for (String line = input.readLine(); line != null; line = input.readLine()) {
      JsonObject asked = JsonParser.parseString(line).getAsJsonObject();
      plc.set(asked.get("set").getAsString(), asked.get("value"));
      JsonLines.say("set", asked.get("set"));
    }
    System.exit(0);
  }

  private static Set<EndpointConfiguration> endpoints(
      OwnCertificate own, int port, boolean guarded) {
    Set<EndpointConfiguration> all = new LinkedHashSet<>();
    for (SecurityPolicy policy :
        List.of(
            SecurityPolicy.None,
            SecurityPolicy.Basic256Sha256,
            SecurityPolicy.Aes256_Sha256_RsaPss)) {
      boolean secured = policy != SecurityPolicy.None;
      all.add(
          EndpointConfiguration.newBuilder()
              .setBindAddress("127.0.0.1")
              .setHostname("127.0.0.1")
              .setBindPort(port)
              .setCertificate(own.certificate)
              .setSecurityPolicy(policy)
              .setSecurityMode(
                  secured ? MessageSecurityMode.SignAndEncrypt : MessageSecurityMode.None)
              .addTokenPolicies(
                  guarded
                      ? OpcUaServerConfig.USER_TOKEN_POLICY_USERNAME
                      : OpcUaServerConfig.USER_TOKEN_POLICY_ANONYMOUS)
              .build());
    }
    return all;
  }

  private static int freePort() throws Exception {
    try (ServerSocket socket = new ServerSocket(0, 1, InetAddress.getLoopbackAddress())) {
      return socket.getLocalPort();
    }
  }

  /** Examines a client's certificate in every way that Milo knows; trust is given unasked, or not. */
  private static final class Examining extends DefaultServerCertificateValidator {
    private final TrustListManager trusted;
    private final boolean refuses;

    Examining(TrustListManager trusted, boolean refuses) {
      super(trusted, ValidationCheck.ALL_OPTIONAL_CHECKS);
      this.trusted = trusted;
      this.refuses = refuses;
    }

    @Override
    public void validateCertificateChain(List<X509Certificate> chain) throws UaException {
      if (!refuses) {
        trusted.addTrustedCertificate(chain.get(0));
      }
      super.validateCertificateChain(chain);
    }

    @Override
    public void validateCertificateChain(List<X509Certificate> chain, String applicationUri)
        throws UaException {
      if (!refuses) {
        trusted.addTrustedCertificate(chain.get(0));
      }
      super.validateCertificateChain(chain, applicationUri);
    }
  }
}
