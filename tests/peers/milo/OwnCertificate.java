import java.security.KeyPair;
import java.security.MessageDigest;
import java.security.cert.X509Certificate;
import org.eclipse.milo.opcua.stack.core.util.SelfSignedCertificateBuilder;
import org.eclipse.milo.opcua.stack.core.util.SelfSignedCertificateGenerator;

/** A key of 2048 bits and its certificate for 127.0.0.1, made anew. */
final class OwnCertificate {
  final KeyPair keys;
  final X509Certificate certificate;
  final String applicationUri;

  OwnCertificate(String name) throws Exception {
    applicationUri = "urn:judge:milo:" + name;
    keys = SelfSignedCertificateGenerator.generateRsaKeyPair(2048);
    certificate =
        new SelfSignedCertificateBuilder(keys)
            .setCommonName("Milo " + name)
            .setApplicationUri(applicationUri)
            .addIpAddress("127.0.0.1")
            .build();
  }

  String sha256() throws Exception {
    return JsonLines.hex(MessageDigest.getInstance("SHA-256").digest(certificate.getEncoded()));
  }
}
