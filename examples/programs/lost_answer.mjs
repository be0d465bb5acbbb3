// Does your program send a write again when its answer is lost? A robot would then move, or be
// written, twice. This loses the answer on a simulated controller, runs your program, counts what
// arrived, and puts the controller back as it was. It needs Node.js 18 or later and nothing else.
//
//     robolink --json sim epson --tcp 127.0.0.1:5000        (prints "url" and "control")
//     node lost_answer.mjs CONTROL "TLSet 2, XY" -- ./my_line_program --robot 127.0.0.1:5000
//
// Exit codes: 0 sent once, 1 sent more than once, 2 the words are wrong, the simulator refused, or
// your program never sent such a write, 3 the simulator is not there, 130 Ctrl-C.
import { spawn } from "node:child_process";

class Refused extends Error {}
class NotThere extends Error {}

/** One simulated cell; `url` is the "control" that the simulator prints. */
class SimulatedCell {
  constructor(url) {
    this.url = url;
  }

  /** Do an act (docs/control-api.md) and return its document. */
  async do(act, given = {}) {
    const request = { method: "POST", body: JSON.stringify(given), signal: AbortSignal.timeout(10_000) };
    const reply = await fetch(`${this.url}/${act}`, request).catch((error) => {
      throw new NotThere(`${this.url}: ${error.cause?.message ?? error.message}`);
    });
    const document = await reply.json().catch(() => {
      throw new NotThere(`${this.url}: what answers is no simulator of robolink`);
    });
    if (document.ok) return document;
    throw new Refused([`${act}: ${document.error}`, document.remedy].filter(Boolean).join(" "));
  }
}

/** Run a command with this terminal; return its exit code, 128 and more where a signal ended it. */
function ended([program, ...words]) {
  return new Promise((resolve, reject) => {
    const child = spawn(program, words, { stdio: "inherit" });
    child.once("error", (error) => reject(new Refused(`${program}: ${error.message}`)));
    child.once("close", (code) => resolve(code ?? 128));
  });
}

async function timesSent(cell, match, command) {
  const seen = async () => [(await cell.do("faults")).times_fired, (await cell.do("counters")).tool_writes];
  const before = await seen();
  await cell.do("add_fault", { action: "drop_reply", match });
  const code = await ended(command);
  const [fired, sent] = (await seen()).map((count, index) => count - before[index]);
  return { code, fired, sent };
}

const [control, match, dashes, ...command] = process.argv.slice(2);
let interrupted = false;
process.on("SIGINT", () => (interrupted = true)); // your program gets it too; then all is put back
try {
  if (dashes !== "--" || command.length === 0 || !URL.canParse(control))
    throw new Refused('usage: node lost_answer.mjs CONTROL "TLSet 2, XY" -- COMMAND ...');
  const cell = new SimulatedCell(control);
  await cell.do("snapshot", { name: "before" });
  try {
    const { code, fired, sent } = await timesSent(cell, match, command);
    console.log(`answers lost: ${fired}, writes that arrived: ${sent}, your program ended with ${code}`);
    if (fired === 0) throw new Refused(`your program never sent ${match}`);
    process.exitCode = sent > 1 ? 1 : 0;
  } finally {
    await cell.do("clear_faults");
    await cell.do("restore", { name: "before" });
  }
} catch (error) {
  console.error(`lost_answer: ${error.message}`);
  process.exitCode = error instanceof NotThere ? 3 : 2;
}
if (interrupted) process.exitCode = 130;
