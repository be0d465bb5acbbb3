// An OPC UA server by node-opcua, in the shape of a CODESYS runtime: the arrays of the mailbox, whose
// words it fetches from and stores in a simulated PLC over Modbus TCP at each request, and the tools
// of a machine as arrays, a structure and signals of its own. What is written it prints, a JSON object
// a line; a line {"set": NAME, "value": ...} on its input changes a variable of the machine.
//
//     node opcua_server.mjs NODE_OPCUA FOLDER MODBUS_PORT [USER PASSWORD] [--refuse-certificates] [--port=N]
import { createInterface } from "node:readline";
import { createRequire } from "node:module";
import { once } from "node:events";
import { pathToFileURL } from "node:url";
import { readFileSync, writeFileSync } from "node:fs";
import { createHash, X509Certificate } from "node:crypto";
import net from "node:net";

const [modules, folder, plc, ...rest] = process.argv.slice(2);
const [user, password] = rest.filter((word) => !word.startsWith("--"));
const require = createRequire(`${modules}/`);
const ua = await import(pathToFileURL(require.resolve("node-opcua")).href);
const { DataType, DataValue, StatusCodes, VariantArrayType } = ua;
const say = (told) => process.stdout.write(`${JSON.stringify(told)}\n`);

// Modbus TCP, one request at a time: all that the mailbox needs of it.
const wire = net.connect(Number(plc), "127.0.0.1");
await once(wire, "connect");
let before = Promise.resolve();
const ask = (pdu) => (before = before.then(() => exchange(pdu)));

async function exchange(pdu) {
  const head = Buffer.from([0, 1, 0, 0, 0, 0, 255]);
  head.writeUInt16BE(pdu.length + 1, 4);
  wire.write(Buffer.concat([head, pdu]));
  let got = Buffer.alloc(0);
  while (got.length < 6 || got.length < 6 + got.readUInt16BE(4)) {
    got = Buffer.concat([got, (await once(wire, "data"))[0]]);
  }
  if (got[7] !== pdu[0]) throw new Error(`exception ${got[8]}`);
  return got.subarray(8);
}

// What is read in several requests is of several moments: the response is read in one, slots whole.
async function fetched(address, count, atOnce) {
  const words = [];
  for (let at = 0; at < count; at += atOnce) {
    const pdu = Buffer.alloc(5);
    pdu[0] = 4;
    pdu.writeUInt16BE(address + at, 1);
    pdu.writeUInt16BE(Math.min(atOnce, count - at), 3);
    const answer = await ask(pdu);
    for (let byte = 1; byte <= answer[0]; byte += 2) words.push(answer.readUInt16BE(byte));
  }
  return Uint16Array.from(words);
}

async function store(address, words) {
  const pdu = Buffer.alloc(6 + 2 * words.length);
  pdu[0] = 16;
  pdu.writeUInt16BE(address, 1);
  pdu.writeUInt16BE(words.length, 3);
  pdu[5] = 2 * words.length;
  words.forEach((word, at) => pdu.writeUInt16BE(word, 6 + 2 * at));
  await ask(pdu);
}

// A structure needs a type, and node-opcua takes one from a file.
const SPACES = ["http://opcfoundation.org/UA/DI/", "http://PLCopen.org/OpcUa/IEC61131-3/", "CODESYSSPV3/3S/IecVarAccess"];
const ST_TOOL = ["rX", "rY", "rZ", "rU"].map((name) => `<Field Name="${name}" DataType="i=11"/>`);
writeFileSync(
  `${folder}/types.xml`,
  `<UANodeSet xmlns="http://opcfoundation.org/UA/2011/03/UANodeSet.xsd">
  <NamespaceUris>${SPACES.map((uri) => `<Uri>${uri}</Uri>`).join("")}</NamespaceUris>
  <UADataType NodeId="ns=3;i=3000" BrowseName="3:ST_Tool"><DisplayName>ST_Tool</DisplayName>
    <References><Reference ReferenceType="i=45" IsForward="false">i=22</Reference>
      <Reference ReferenceType="i=38">ns=3;i=3001</Reference></References>
    <Definition Name="3:ST_Tool">${ST_TOOL.join("")}</Definition></UADataType>
  <UAObject NodeId="ns=3;i=3001" BrowseName="Default Binary" SymbolicName="DefaultBinary">
    <DisplayName>Default Binary</DisplayName>
    <References><Reference ReferenceType="i=38" IsForward="false">ns=3;i=3000</Reference>
      <Reference ReferenceType="i=40">i=76</Reference></References></UAObject>
</UANodeSet>`,
);

const server = new ua.OPCUAServer({
  nodeset_filename: [ua.nodesets.standard, `${folder}/types.xml`],
  port: Number(rest.find((word) => word.startsWith("--port="))?.slice("--port=".length) ?? 0),
  host: "127.0.0.1",
  hostname: "127.0.0.1",
  allowAnonymous: user === undefined,
  userManager: { isValidUser: (name, secret) => name === user && secret === password },
  securityPolicies: ["None", "Basic256Sha256", "Aes256_Sha256_RsaPss"].map((p) => ua.SecurityPolicy[p]),
  serverCertificateManager: new ua.OPCUACertificateManager({
    rootFolder: folder,
    automaticallyAcceptUnknownCertificate: !rest.includes("--refuse-certificates"),
  }),
});
await server.initialize();
const space = server.engine.addressSpace;
const ns = space.getNamespace(SPACES[2]);

const folders = {};
let place = space.rootFolder.objects;
for (const name of ["DeviceSet", "Judge", "Resources", "Application", "GlobalVars"]) {
  const above = name === "DeviceSet" ? { organizedBy: place } : { componentOf: place };
  place = ns.addObject({ ...above, browseName: name, nodeId: `s=|tree|${name}` });
}

function variable(list, name, dataType, length, value, more = {}) {
  folders[list] ??= ns.addObject({ componentOf: place, browseName: list, nodeId: `s=|tree|${list}` });
  return ns.addVariable({
    componentOf: folders[list],
    browseName: name,
    nodeId: `s=|var|Judge.Application.${list}.${name}`,
    dataType,
    ...(length ? { valueRank: 1, arrayDimensions: [length] } : {}),
    minimumSamplingInterval: 20,
    value,
    ...more,
  });
}

// The mailbox. What is read was fetched from the PLC for that, what is written is stored there whole.
const uint = (value) =>
  new DataValue({
    value: value.length === undefined
      ? { dataType: DataType.UInt16, value }
      : { dataType: DataType.UInt16, arrayType: VariantArrayType.Array, value },
    statusCode: StatusCodes.Good,
    sourceTimestamp: new Date(),
  });

// Each response has a count of its own at both ends, as in a PLC each cycle has.
let cycles = 0;
const framed = (words) => {
  cycles = (cycles + 1) & 0xffff;
  return Uint16Array.from([cycles, ...words, cycles]);
};
variable("RL_Symbols", "response", "UInt16", 114, {
  timestamped_get: (answer) => fetched(0, 112, 112).then((now) => answer(null, uint(framed(now))), answer),
});
variable("RL_Symbols", "slots", "UInt16", 544, {
  timestamped_get: (answer) => fetched(112, 544, 3 * 36).then((now) => answer(null, uint(now)), answer),
});
for (const [name, address, length] of [["command", 0, 64], ["heartbeat", 62, 0]]) {
  let last = length ? new Uint16Array(length) : 0;
  variable("RL_Symbols", name, "UInt16", length, {
    timestamped_get: (answer) => answer(null, uint(last)),
    timestamped_set: (given, answer) => {
      const value = given.value.value;
      if (value.length !== (length || undefined)) return answer(null, StatusCodes.BadTypeMismatch);
      last = length ? Uint16Array.from(value) : value;
      say({ wrote: name });
      store(address, length ? [...last] : [last]).then(
        () => answer(null, StatusCodes.Good),
        answer,
      );
    },
  });
}

// The machine: arrays, a structure, a signal, and what may only be read.
const made = {};
function own(name, dataType, length, value, more) {
  let now = value;
  const shown = () => ({
    dataType: DataType[dataType] ?? DataType.ExtensionObject,
    ...(length ? { arrayType: VariantArrayType.Array } : {}),
    value: now,
  });
  const node = variable("GVL", name, dataType, length, {
    get: () => new ua.Variant(shown()),
    set: (given) => {
      if (length && given.value.length !== length) return StatusCodes.BadTypeMismatch;
      now = given.value;
      say({ wrote: name, value: now?.toJSON?.() ?? (length ? [...now] : now) });
      return StatusCodes.Good;
    },
  }, more);
  made[name] = (given) => (now = length ? Float64Array.from(given) : given);
  return node;
}
own("aTool1", "Double", 6, new Float64Array([12, -3.5, -20, 15, 0, 0]));
own("aTool2", "Double", 6, new Float64Array([-12, -3.5, -21, 0, 0, 0]));
own("aShown", "Double", 6, new Float64Array(6), { accessLevel: "CurrentRead", userAccessLevel: "CurrentRead" });
own("aReal", "Float", 6, new Float32Array(6));
own("xPermit", "Boolean", 0, true);
own("uiCycle", "UInt32", 0, 0);
setInterval(() => made.uiCycle((performance.now() / 10) | 0), 5).unref();
const type = space.findDataType("ST_Tool", ns.index);
own("stTool", type.nodeId, 0, space.constructExtensionObject(type, { rX: 1.5, rY: -2.5, rZ: 30, rU: 0 }));

await server.start();
const pem = readFileSync(server.certificateFile ?? `${folder}/own/certs/certificate.pem`);
say({
  listening: {
    port: server.endpoints[0].port,
    sha256: createHash("sha256").update(new X509Certificate(pem).raw).digest("hex"),
  },
});
createInterface({ input: process.stdin })
  .on("line", (line) => {
    const asked = JSON.parse(line);
    made[asked.set](asked.value);
    say({ set: asked.set });
  })
  .on("close", () => process.exit());
