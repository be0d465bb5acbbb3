// An OPC UA client by node-opcua that does what it is told, a JSON object a line, and answers so:
//
//     {"do": "browse", "path": ["DeviceSet", "Device"]}       names of the children
//     {"do": "read", "nodes": ["ns=4;s=..."]}                 status, type and value of each
//     {"do": "write", "node": "...", "type": "Double", "value": [1, 2], "range": "0:1"?, "stamped": true?}
//     {"do": "watch", "node": "..."}      the values that a subscription brings, as they come
//
//     node opcua_client.mjs NODE_OPCUA FOLDER URL POLICY [USER PASSWORD]
import { createInterface } from "node:readline";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const [modules, folder, url, policy, user, password] = process.argv.slice(2);
const require = createRequire(`${modules}/`);
const ua = await import(pathToFileURL(require.resolve("node-opcua")).href);
const say = (told) => process.stdout.write(`${JSON.stringify(told)}\n`);
const plain = (value) => value?.toJSON?.() ?? (ArrayBuffer.isView(value) ? [...value] : value);

const client = ua.OPCUAClient.create({
  endpointMustExist: false,
  securityMode: policy === "None" ? ua.MessageSecurityMode.None : ua.MessageSecurityMode.SignAndEncrypt,
  securityPolicy: ua.SecurityPolicy[policy],
  connectionStrategy: { maxRetry: 0 },
  clientCertificateManager: new ua.OPCUACertificateManager({
    rootFolder: folder,
    automaticallyAcceptUnknownCertificate: true,
  }),
});
const who = user
  ? { type: ua.UserTokenType.UserName, userName: user, password }
  : { type: ua.UserTokenType.Anonymous };

const acts = {
  async browse({ path }) {
    let node = "ObjectsFolder";
    let found = (await session.browse(node)).references;
    for (const name of path) {
      const next = found.find((one) => one.browseName.name === name);
      if (!next) throw new Error(`no ${name} among ${found.map((one) => one.browseName.name)}`);
      node = next.nodeId;
      found = (await session.browse(node)).references;
    }
    return { node: node.toString(), children: found.map((one) => one.browseName.name) };
  },
  async read({ nodes }) {
    const got = await session.read(nodes.map((nodeId) => ({ nodeId, attributeId: ua.AttributeIds.Value })));
    return got.map((one) => ({
      status: one.statusCode.name,
      type: ua.DataType[one.value.dataType],
      value: plain(one.value.value),
    }));
  },
  async write({ node, type, value, range, stamped }) {
    const arrayType = Array.isArray(value) ? ua.VariantArrayType.Array : ua.VariantArrayType.Scalar;
    const status = await session.write({
      nodeId: node,
      attributeId: ua.AttributeIds.Value,
      ...(range && { indexRange: new ua.NumericRange(range) }),
      value: {
        value: new ua.Variant({ dataType: ua.DataType[type], arrayType, value }),
        ...(stamped && { sourceTimestamp: new Date() }),
      },
    });
    return { status: status.name };
  },
  async watch({ node }) {
    const subscription = await session.createSubscription2({
      requestedPublishingInterval: 20, requestedLifetimeCount: 1000, requestedMaxKeepAliveCount: 10,
      maxNotificationsPerPublish: 100, publishingEnabled: true, priority: 1,
    });
    const item = await subscription.monitor(
      { nodeId: node, attributeId: ua.AttributeIds.Value },
      { samplingInterval: 20, discardOldest: true, queueSize: 10 },
      ua.TimestampsToReturn.Neither,
    );
    item.on("changed", (now) => say({ changed: node, value: plain(now.value.value) }));
    return { watched: node };
  },
};

let session;
try {
  await client.connect(url);
  session = await client.createSession(who);
} catch (error) {
  say({ refused: error.message });
  process.exit(1);
}
say({ connected: url });
for await (const line of createInterface({ input: process.stdin })) {
  const { do: act, ...given } = JSON.parse(line);
  try {
    say({ done: await acts[act](given) });
  } catch (error) {
    say({ failed: error.message });
  }
}
await session.close();
await client.disconnect();
process.exit(0);
