import java.io.DataInputStream;
import java.io.IOException;
import java.io.UncheckedIOException;
import java.net.InetAddress;
import java.net.Socket;
import java.nio.ByteBuffer;
import org.eclipse.milo.opcua.stack.core.types.builtin.unsigned.UShort;
import org.eclipse.milo.opcua.stack.core.types.builtin.unsigned.Unsigned;

/** Modbus TCP, one request at a time: all that the mailbox needs of it. */
final class ModbusPlc {
  private final Socket socket;

  ModbusPlc(int port) throws IOException {
    socket = new Socket(InetAddress.getLoopbackAddress(), port);
    socket.setTcpNoDelay(true);
  }

  /** Words that are read in several requests are of several moments. */
  UShort[] fetched(int address, int count, int atOnce) {
    UShort[] words = new UShort[count];
    for (int from = 0; from < count; from += atOnce) {
      int now = Math.min(atOnce, count - from);
      ByteBuffer pdu = ByteBuffer.allocate(5).put((byte) 4);
      pdu.putShort((short) (address + from)).putShort((short) now);
      ByteBuffer answer = ByteBuffer.wrap(exchanged(pdu.array()));
      answer.position(2);
      for (int at = 0; at < now; at++) {
        words[from + at] = Unsigned.ushort(answer.getShort());
      }
    }
    return words;
  }

  void store(int address, UShort[] words) {
    ByteBuffer pdu = ByteBuffer.allocate(6 + 2 * words.length).put((byte) 16);
    pdu.putShort((short) address).putShort((short) words.length).put((byte) (2 * words.length));
    for (UShort word : words) {
      pdu.putShort(word.shortValue());
    }
    exchanged(pdu.array());
  }

  private synchronized byte[] exchanged(byte[] pdu) {
    try {
      ByteBuffer frame = ByteBuffer.allocate(7 + pdu.length).putShort((short) 1).putShort((short) 0);
      frame.putShort((short) (pdu.length + 1)).put((byte) 255).put(pdu);
      socket.getOutputStream().write(frame.array());
      DataInputStream input = new DataInputStream(socket.getInputStream());
      byte[] head = new byte[7];
      input.readFully(head);
      byte[] answer = new byte[ByteBuffer.wrap(head).getShort(4) - 1];
      input.readFully(answer);
      if (answer[0] != pdu[0]) {
        throw new IOException("exception " + answer[1]);
      }
      return answer;
    } catch (IOException error) {
      throw new UncheckedIOException(error);
    }
  }
}
