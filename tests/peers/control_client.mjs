// A client that shares nothing with robolink: JavaScript, with what Node.js brings. It starts a
// simulated cell, has a person teach two points over the control API, calculates the tool, writes
// it over Remote Ethernet, and presses the emergency stop. What it saw, it prints as JSON.
//
//     node control_client.mjs PYTHON
import { spawn } from "node:child_process";
import { createInterface } from "node:readline";
import net from "node:net";
import { once } from "node:events";

const simulator = spawn(
  process.argv[2],
  ["-m", "robolink_cli", "--json", "sim", "epson", "--tcp", "127.0.0.1:0", "--with-parent"],
  { stdio: ["ignore", "pipe", "inherit"] },
);
const [first] = await once(createInterface({ input: simulator.stdout }), "line");
const served = JSON.parse(first);

async function act(name, given = {}) {
  const reply = await fetch(`${served.control}/${name}`, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(given),
  });
  return { status: reply.status, ...(await reply.json()) };
}

async function done(name, given = {}) {
  const answer = await act(name, given);
  if (!answer.ok) throw new Error(`${name}: ${answer.error}`);
  return answer;
}

const place = new URL(served.url.replace("epson+tcp", "http"));
const wire = net.connect(Number(place.port), place.hostname);
const answers = createInterface({ input: wire })[Symbol.asyncIterator]();

async function ask(request) {
  wire.write(`${request}\r\n`);
  return (await answers.next()).value;
}

// The flange in two poses whose tip is on the same pin: F1 + R1 t = F2 + R2 t.
await done("set_world", { eye_sigma_mm: 0 });
await done("teach");
const one = (await done("teach_point", { number: 901, u_deg: 0 })).flange;
const two = (await done("teach_point", { number: 902, u_deg: 90 })).flange;
await done("auto");
const rad = (deg) => (deg * Math.PI) / 180;
const a = Math.cos(rad(one.u_deg)) - Math.cos(rad(two.u_deg));
const b = Math.sin(rad(one.u_deg)) - Math.sin(rad(two.u_deg));
const [dx, dy] = [two.x_mm - one.x_mm, two.y_mm - one.y_mm];
const x = (a * dx + b * dy) / (a * a + b * b);
const y = (a * dy - b * dx) / (a * a + b * b);

const login = await ask("$Login,");
const before = (await done("truth")).stored["1"];
const written = await ask(
  `$Execute,"TLSet 1, XY(${x.toFixed(3)}, ${y.toFixed(3)}, ${before.z_mm}, 0)"`,
);
const truth = await done("truth");
await done("press_estop");
const stopped = await ask("$GetStatus");
const refused = await act("dance");
const log = await done("log");
console.log(
  JSON.stringify({
    login,
    written,
    stored: truth.stored["1"],
    tip: truth.tips["1"],
    stopped,
    refused: refused.status,
    requests: log.lines.filter((line) => line.direction === ">").length,
    simulator: simulator.pid,
  }),
);
process.exit(0); // the simulator sees that its parent is gone
