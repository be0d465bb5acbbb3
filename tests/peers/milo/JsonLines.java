import com.google.gson.JsonArray;
import com.google.gson.JsonElement;
import com.google.gson.JsonNull;
import com.google.gson.JsonObject;
import com.google.gson.JsonPrimitive;
import java.lang.reflect.Array;
import org.eclipse.milo.opcua.stack.core.BuiltinDataType;
import org.eclipse.milo.opcua.stack.core.StatusCodes;
import org.eclipse.milo.opcua.stack.core.types.builtin.ByteString;
import org.eclipse.milo.opcua.stack.core.types.builtin.ExtensionObject;
import org.eclipse.milo.opcua.stack.core.types.builtin.NodeId;
import org.eclipse.milo.opcua.stack.core.types.builtin.StatusCode;
import org.eclipse.milo.opcua.stack.core.types.builtin.Variant;
import org.eclipse.milo.opcua.stack.core.types.builtin.unsigned.Unsigned;

/** Values of OPC UA as JSON and back, and one JSON object a line on the output. */
final class JsonLines {
  private JsonLines() {}

  /** Keys and values in turn. */
  static JsonObject object(Object... pairs) {
    JsonObject told = new JsonObject();
    for (int at = 0; at < pairs.length; at += 2) {
      told.add((String) pairs[at], plain(pairs[at + 1]));
    }
    return told;
  }

  static synchronized void say(Object... pairs) {
    System.out.println(object(pairs));
    System.out.flush();
  }

  /** A structure of which no definition is used is its encoding and its bytes. */
  static JsonElement plain(Object value) {
    if (value == null) {
      return JsonNull.INSTANCE;
    }
    if (value instanceof JsonElement) {
      return (JsonElement) value;
    }
    if (value.getClass().isArray()) {
      JsonArray all = new JsonArray();
      for (int at = 0; at < Array.getLength(value); at++) {
        all.add(plain(Array.get(value, at)));
      }
      return all;
    }
    if (value instanceof Boolean) {
      return new JsonPrimitive((Boolean) value);
    }
    if (value instanceof Number) {
      return new JsonPrimitive((Number) value);
    }
    if (value instanceof ExtensionObject) {
      ExtensionObject structure = (ExtensionObject) value;
      byte[] body = ((ByteString) structure.getBody()).bytesOrEmpty();
      return object("encoding", structure.getEncodingId().toParseableString(), "body", hex(body));
    }
    return new JsonPrimitive(value.toString());
  }

  static String typeOf(Variant value) {
    return value.getDataType()
        .map(BuiltinDataType::fromNodeId)
        .map(type -> type == null ? "ExtensionObject" : type.name())
        .orElse("Null");
  }

  /** Type is a built-in type, or ExtensionObject for a structure as {@link #plain} tells one. */
  static Variant variant(String type, JsonElement given) {
    if (!given.isJsonArray()) {
      return new Variant(scalar(type, given));
    }
    JsonArray all = given.getAsJsonArray();
    Class<?> of = BuiltinDataType.valueOf(type).getBackingClass();
    Object array = Array.newInstance(of, all.size());
    for (int at = 0; at < all.size(); at++) {
      Array.set(array, at, scalar(type, all.get(at)));
    }
    return new Variant(array);
  }

  private static Object scalar(String type, JsonElement given) {
    switch (type) {
      case "Boolean":
        return given.getAsBoolean();
      case "Byte":
        return Unsigned.ubyte(given.getAsInt());
      case "Int16":
        return given.getAsShort();
      case "UInt16":
        return Unsigned.ushort(given.getAsInt());
      case "UInt32":
        return Unsigned.uint(given.getAsLong());
      case "Float":
        return given.getAsFloat();
      case "Double":
        return given.getAsDouble();
      case "ExtensionObject":
        JsonObject told = given.getAsJsonObject();
        return new ExtensionObject(
            ByteString.of(bytes(told.get("body").getAsString())),
            NodeId.parse(told.get("encoding").getAsString()));
      default:
        throw new IllegalArgumentException(type);
    }
  }

  /** The name as OPC 10000-6 has it: BadTypeMismatch. */
  static String name(StatusCode status) {
    return StatusCodes.lookup(status.getValue())
        .map(found -> found[0].replace("_", ""))
        .orElse(status.toString());
  }

  static String hex(byte[] bytes) {
    StringBuilder digits = new StringBuilder();
    for (byte one : bytes) {
      digits.append(String.format("%02x", one));
    }
    return digits.toString();
  }

  static byte[] bytes(String digits) {
    byte[] bytes = new byte[digits.length() / 2];
    for (int at = 0; at < bytes.length; at++) {
      bytes[at] = (byte) Integer.parseInt(digits.substring(2 * at, 2 * at + 2), 16);
    }
    return bytes;
  }
}
