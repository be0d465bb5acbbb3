// The script of every page: the live stream, presses, held keys and STOP. It knows no screen: what a
// button sends stands in its attributes, and every sentence comes from the server.
"use strict";
(() => {
const GREY_MS = 1000; // silence after which nothing but STOP can be pressed
const ANEW_MS = 2000; // silence after which the stream is made anew, each second, for ever
const HOLD_MS = 350; // a shorter press of a jog key is one step
const BEAT_MS = 100, LEASE_MS = 250; // of a held key; the job has a clock of its own
const STOP_MS = 500; // a STOP that nothing confirms by then has failed, for all anybody knows
const STOP_OLD_MS = 5000;
const REMOVED = 4003, CHANGED = 4001; // why the server closed the stream
const SLEEP_MS = 60000, WAKE_MS = 700; // the first touch after a rest only wakes
const place = (id) => document.getElementById(id);
const page = document.body, data = page.dataset, live = "live" in data;
const now = () => performance.now();
const identity = () => Array.from(crypto.getRandomValues(new Uint8Array(12)), (b) => b.toString(16).padStart(2, "0")).join("");

// The stream. It is fresh when a whole screen, and then the clock of the server, came by it.
let socket = null, begun = 0, ended = false, atMs = null, heard = -Infinity, shown = false, fresh = false, silent = live, tries = 0;
let number = Number(data.number), token = data.token, server = "", readAt = null, lookedAt = null, lived = now(), heardAt = null;

function connect() {
  const old = socket;
  const address = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`;
  begun = now();
  tries += 1;
  fresh = shown = ended = false;
  const query = data.cell ? `cell=${encodeURIComponent(data.cell)}` : data.query;
  const made = new WebSocket(query ? `${address}?${query}` : address);
  socket = made;
  made.onmessage = (event) => { if (made === socket) hear(JSON.parse(event.data)); };
  made.onclose = (event) => { if (made === socket) closed(event.code); };
  if (old) { old.onmessage = old.onclose = null; old.close(); }
}

// Another person, or another pairing: what this page may do now, its server says.
function closed(code) {
  ended = true;
  if (code === CHANGED) connect();
  else if (code === REMOVED) renew();
}

function send(frame) {
  if (!socket || socket.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify(frame));
  return true;
}

function hear(frame) {
  heard = now();
  if (frame.t === "hello") {
    token = frame.token;
    if (server && server !== frame.server) renew();
    server = frame.server;
  } else if (frame.t === "screen") {
    put(frame);
    shown = true;
  } else if (frame.t === "beat") {
    atMs = typeof frame.at_ms === "number" ? {server: frame.at_ms, now: now(), date: Date.now()} : null;
    fresh = shown;
    readAt = typeof frame.age_ms === "number" ? now() - frame.age_ms : null;
    lookedAt = typeof frame.look_ms === "number" ? now() - frame.look_ms : null;
    if (document.visibilityState === "visible") send({t: "pong"});
  } else if (frame.t === "stopped") stopAnswered(frame);
  else if (frame.t === "refused") note(frame.why, true);
  look();
}

// Another server may bring other files; a page is left only when the next one is there.
async function renew() {
  try {
    const answer = await fetch(location.href, {cache: "no-store"});
    if (answer.redirected) location.assign(answer.url);
    const version = answer.ok && /data-version="(\w+)"/.exec(await answer.text());
    if (version && version[1] !== data.version) location.reload();
  } catch { /* the stream says that nobody is there */ }
}

function say(element, values) {
  let text = element.dataset.text;
  for (const [name, value] of Object.entries(values)) text = text.replace(`{${name}}`, value);
  if (element.textContent !== text) element.textContent = text;
}

const isAtEnd = (main) => main.scrollTop + main.clientHeight >= main.scrollHeight - 8;

function look() {
  const quiet = now() - heard;
  if (live) {
    silent = quiet > GREY_MS || !fresh;
    if (silent && held) release();
    page.classList.toggle("silent", silent);
    if (!silent) { lived = heard; heardAt = new Date(Date.now() - quiet); }
    const lost = silent && now() - lived > (heardAt ? GREY_MS : ANEW_MS);
    place("lost").hidden = !lost;
    if (lost) {
      say(place("lost").querySelector("[data-lost]"), {s: Math.floor((now() - lived) / 1000)});
      say(place("lost").querySelector("[data-heard]"), {at: heardAt ? heardAt.toLocaleTimeString("en-GB") : "?"});
      say(place("lost").querySelector("[data-tried]"), {n: tries});
    } else if (!silent) tries = 0;
    if ((quiet > ANEW_MS || ended) && now() - begun >= 1000) connect();
  }
  const age = document.querySelector("[data-age]");
  if (age && readAt !== null) say(age, {s: Math.max(0, (now() - readAt) / 1000).toFixed(1)});
  const picture = document.querySelector("[data-look]");
  if (picture) {
    const seconds = lookedAt === null ? Infinity : Math.max(0, (now() - lookedAt) / 1000);
    picture.classList.toggle("old", seconds > Number(picture.dataset.old));
    if (lookedAt !== null) {
      const age = picture.querySelector("[data-look-age]");
      const text = (seconds < 120 ? age.dataset.text : age.dataset.minutes)
        .replace("{s}", seconds.toFixed(0)).replace("{m}", Math.floor(seconds / 60));
      if (age.textContent !== text) age.textContent = text;
    }
  }
  if (!asleep && now() - touched > SLEEP_MS) sleep();
  place("asleep").hidden = !asleep;
  const main = place("main"), more = place("more");
  more.hidden = main.scrollHeight <= main.clientHeight + (more.hidden ? 8 : 0);
  const text = isAtEnd(main) ? more.dataset.up : more.dataset.down;
  if (more.textContent !== text) more.textContent = text;
}

// Parts come whole. What was typed for this question stays; a word half composed is not torn.
let composing = false, waiting = null;
function put(frame) {
  const other = frame.number !== number || frame.screen !== data.screen;
  if (composing && !other) { waiting = {...frame, parts: {...(waiting || {}).parts, ...frame.parts}}; return; }
  const parts = {...(waiting && !other ? waiting.parts : {}), ...frame.parts};
  waiting = null;
  composing = composing && !other;
  if (other && held) release();
  number = frame.number;
  data.number = String(number);
  data.screen = frame.screen;
  for (const [id, html] of Object.entries(parts)) exchange(place(id), html, other);
  if (other) {
    for (const input of document.querySelectorAll("#main [data-typed]")) input.value = "";
    place("main").scrollTop = 0;
  }
  if (press) under(press.box)?.classList.add("down");
}

function exchange(part, html, other) {
  const inputs = other ? [] : Array.from(part.querySelectorAll("[data-typed]"), (one) => [one.dataset.typed, one.value, one.selectionStart]);
  const focus = part.contains(document.activeElement) ? document.activeElement : null;
  const same = (one) => focus && one.tagName === focus.tagName && one.getAttribute("href") === focus.getAttribute("href") && JSON.stringify(one.dataset) === JSON.stringify(focus.dataset);
  part.innerHTML = html;
  for (const [name, value] of inputs) { const input = part.querySelector(`[data-typed="${name}"]`); if (input) input.value = value; }
  if (!focus || other) return;
  const again = Array.from(part.querySelectorAll("button,a,input")).find(same);
  if (again) again.focus({preventScroll: true});
  const at = again && inputs.find(([name]) => name === again.dataset.typed);
  if (at) again.setSelectionRange(at[2], at[2]);
}

const under = (box) => document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2)?.closest(".b,.tile");

// A press belongs to the place, and to the question, at which the finger went down. What stands
// there when it comes up does not matter.
const PRESSED = ".b,.tile,#more";
let press = null, held = null, touched = now(), asleep = false, woken = -Infinity;

function pressOf(button, pointer) {
  return {pointer, number, box: button.getBoundingClientRect(), what: {...button.dataset}, id: button.id,
    href: button.getAttribute("href"), form: button.closest("main,footer") && document.querySelector("[data-form]")};
}

const inside = (box, event) => event.clientX >= box.left && event.clientX <= box.right && event.clientY >= box.top && event.clientY <= box.bottom;
const isOff = (button) => button.getAttribute("aria-disabled") === "true" || (silent && button.id !== "more" && !("close" in button.dataset));

function down(event) {
  if (event.target.closest("#stop")) {
    drop();
    touched = now();
    asleep = false;
    event.preventDefault();
    if (event.button === 0) stop();
    return;
  }
  look(); // what is silent is known by now, not by the last round
  const slept = asleep || now() - touched > SLEEP_MS;
  touched = now();
  if (slept) { asleep = false; woken = now(); look(); }
  if (now() - woken < WAKE_MS) { event.preventDefault(); return; }
  stayAwake();
  if (press || held) { drop(); return; } // a second finger
  const over = event.target.closest(".over");
  if (over && !event.target.closest(".b")) {
    if (over.id === "unstopped") stop();
    else if (over.id !== "lost") over.hidden = true;
    return;
  }
  const button = event.target.closest(PRESSED);
  if (!button || isOff(button) || event.button !== 0) return;
  press = pressOf(button, event.pointerId);
  button.classList.add("down");
  // The element may be replaced while the finger is on it; the page is not.
  document.documentElement.setPointerCapture(event.pointerId);
  if (press.what.hold) press.timer = setTimeout(hold, HOLD_MS);
}

function up(event) {
  if (!press || event.pointerId !== press.pointer) return;
  touched = now();
  const done = press, was = held;
  drop();
  if (!was && inside(done.box, event)) act(done);
}

function move(event) {
  if (press && event.pointerId === press.pointer && !inside(press.box, event)) drop();
}

function drop() {
  if (held) release();
  if (press) clearTimeout(press.timer);
  press = null;
  for (const one of document.querySelectorAll(".down")) one.classList.remove("down");
}

function act(done) {
  const {what, href} = done;
  if (done.id === "more") {
    const main = place("main");
    main.scrollTo({top: isAtEnd(main) ? 0 : main.scrollTop + 0.8 * main.clientHeight});
  }
  else if (what.close) place(what.close).hidden = true;
  else if (href) location.assign(href);
  else if (what.key) { if (done.number === number) type(what.key); }
  else if (what.pick) pick(done);
  else if (what.post) post(done);
  else if (what.action) {
    const value = what.field ? typed(what.field) : what.value;
    if (!send({t: "press", number: done.number, action: what.action, value, press: identity(), ...byServer()})) unheard();
  }
}

// Now, by the clock of the server: what was sent before a cable came out is late when it arrives.
// In a tablet that slept one clock stood still, and one may be set anew: the longer time counts, so
// that no press of now is taken for an old one.
function byServer() {
  if (atMs === null) return {};
  return {at_ms: Math.round(atMs.server + Math.max(now() - atMs.now, Date.now() - atMs.date))};
}

const typed = (name) => document.querySelector(`[data-typed="${name}"]`)?.value ?? "";

function type(key) {
  const input = document.querySelector("#main [data-typed]");
  if (!input) return;
  if (key === "back") input.value = input.value.slice(0, -1);
  else if (input.maxLength < 0 || input.value.length < input.maxLength) input.value += key;
}

function pick({what, form}) {
  form.elements[what.pick].value = what.value;
  for (const one of form.querySelectorAll(`[data-pick="${what.pick}"]`)) one.setAttribute("aria-pressed", String(one.dataset.value === what.value));
}

const ask = (path, body) => fetch(path, {method: "POST", keepalive: true, headers: {"Content-Type": "application/json", "X-Robolink-Token": token}, body: JSON.stringify(body)});

async function post({what, form}) {
  const fields = form ? Object.fromEntries(new FormData(form)) : {};
  let answer, said = {};
  try {
    answer = await ask(what.post, {...JSON.parse(what.body || "{}"), ...fields});
    said = await answer.json().catch(() => ({}));
  } catch { unheard(); return; }
  if (!answer.ok) {
    note(said.why, answer.status === 403 && !form);
    if (form) for (const input of form.querySelectorAll("[type=password]")) input.value = "";
  } else if (form && form.dataset.onward) location.replace(form.dataset.onward);
  else if (what.then === "reload") location.reload();
}

let closing = 0;
function note(why, signs) {
  const said = place("note").querySelector("[data-why]");
  said.textContent = why || said.dataset.refused;
  place("note").querySelector("a").hidden = !signs;
  place("note").hidden = false;
  clearTimeout(closing);
  closing = setTimeout(() => { place("note").hidden = true; }, 6000);
}
const unheard = () => note(place("note").querySelector("[data-why]").dataset.unheard, false);

// A held key: beats while this finger is surely there. What ended once never begins again.
function hold() {
  if (!press || silent) return;
  const finger = identity();
  if (!send({t: "hold", number: press.number, axis: press.what.hold, finger, ...byServer()})) { unheard(); drop(); return; }
  held = {finger, last: now(), timer: setInterval(beat, BEAT_MS)};
}

function beat() {
  const late = now() - held.last > LEASE_MS; // the page was stuck: who knows where the finger is
  held.last = now();
  if (late || !send({t: "beat", finger: held.finger, ...byServer()})) drop();
}

function release() {
  clearInterval(held.timer);
  send({t: "release", finger: held.finger});
  held = null;
}

// STOP goes by both ways at once, under one id, until something answers.
let latest = null;
function stop() {
  const one = {press: identity(), begun: now(), done: false};
  const at = byServer();
  latest = one;
  place("stopped").hidden = true;
  place("stop").classList.add("down");
  const tell = () => {
    const age_ms = Math.round(now() - one.begun);
    send({t: "stop", press: one.press, age_ms, ...at});
    ask(data.cell ? "/stop" : "/stop-all", {...(data.cell ? {cell: data.cell} : {}), press: one.press, age_ms, ...at})
      .then(async (answer) => stopAnswered({press: one.press, outcome: answer.ok ? "" : "failed", ...await answer.json()}))
      .catch(() => {});
  };
  tell();
  const again = setInterval(() => { if (one.done || now() - one.begun > STOP_OLD_MS - 500) clearInterval(again); else tell(); }, 400);
  setTimeout(() => { place("stop").classList.remove("down"); if (!one.done && one === latest) unstopped(""); }, STOP_MS);
}

function stopAnswered(frame) {
  if (!latest || frame.press !== latest.press || latest.done) return;
  const good = frame.outcome === "stopped" || frame.outcome === "nothing";
  if (!good) { if (frame.outcome) unstopped(frame.text || frame.why || ""); return; }
  latest.done = true;
  const over = place("stopped");
  for (const one of over.querySelectorAll("[data-outcome]")) one.textContent = one.dataset.outcome === frame.outcome ? one.dataset.text : "";
  over.querySelector("[data-why]").textContent = frame.text || "";
  place("unstopped").hidden = true;
  over.hidden = false;
}

function unstopped(why) {
  place("unstopped").querySelector("[data-why]").textContent = why;
  place("unstopped").hidden = false;
}

// Sleep and waking.
function sleep() { drop(); asleep = true; }

let lock = null;
function stayAwake() {
  if (!navigator.wakeLock || (lock && !lock.released)) return; // it is there over TLS and on loopback only
  navigator.wakeLock.request("screen").then((got) => { lock = got; }, () => {});
}

document.addEventListener("pointerdown", down, {capture: true});
document.addEventListener("pointerup", up, {capture: true});
document.addEventListener("pointermove", move, {capture: true});
document.addEventListener("pointercancel", drop, {capture: true});
addEventListener("blur", drop);
addEventListener("pagehide", drop);
addEventListener("pageshow", (event) => { if (event.persisted) { fresh = false; heard = -Infinity; look(); } });
document.addEventListener("visibilitychange", () => {
  sleep();
  if (live) { fresh = false; heard = Math.min(heard, now() - ANEW_MS - 1); begun = Math.min(begun, now() - 1000); }
  if (document.visibilityState === "visible") { stayAwake(); look(); } else page.classList.toggle("silent", live);
});
document.addEventListener("contextmenu", (event) => { if (!event.target.closest("input")) event.preventDefault(); });
document.addEventListener("compositionstart", () => { composing = true; });
document.addEventListener("compositionend", () => { composing = false; if (waiting) put(waiting); });
document.addEventListener("submit", (event) => event.preventDefault());
place("main").addEventListener("scroll", look, {passive: true});
addEventListener("resize", look);

// A finger was dealt with above. A key of a keyboard is pressed for the question at its own beginning.
let keyed = null;
document.addEventListener("keydown", (event) => {
  touched = now();
  if (event.repeat) { if (event.target.closest("button,a")) event.preventDefault(); return; }
  const stops = event.target.closest("#stop") && (event.key === "Enter" || event.key === " ");
  if (stops) { event.preventDefault(); stop(); return; }
  const button = event.target.closest(PRESSED);
  keyed = button && (event.key === "Enter" || event.key === " ") ? pressOf(button, -1) : null;
  if (event.key === "Enter" && event.target.matches("[data-typed]") && !event.isComposing) {
    const field = event.target.dataset.typed;
    const main = document.querySelector(`[data-field="${field}"]`) || (event.target.form && document.querySelector("#foot [data-post]"));
    if (main && !isOff(main)) act(pressOf(main, -1));
  }
}, {capture: true});
document.addEventListener("click", (event) => {
  const button = event.target.closest(PRESSED);
  if (button) event.preventDefault();
  if (!button || event.detail !== 0 || isOff(button)) return;
  act(keyed || pressOf(button, -1));
  keyed = null;
}, {capture: true});

setInterval(look, 200);
if (live) connect();
look();
})();
