// @ts-check
/** The page: signing in, and then picture, hands and link joined. */

import { Hands } from "./hands.js";
import { Link, post } from "./link.js";

const TICK = 50; // ms: 20 commands a second while something is held
const LIFE = 250; // ms between two signs of life
const STALLED = 500; // ms between two ticks after which the page was asleep: what was held then is held no more
const ZEROS = 3; // a lost zero would cost 0.3 s of driving
/** @param {string} id @returns {any} */
const part = (id) => document.getElementById(id);

const hands = new Hands();
let state = { mine: false, obstacle: "Connecting …", pilot: "", stopped_by: "", hold: "", gate: null };
let zeros = 0, sentAt = -Infinity, shown = "", ticks = 0, tickedAt = -Infinity;
const link = new Link(part("picture"), (newest) => { state = newest; show(); }, () => enter());

function reasonNotToDrive() {
  if (document.hidden) return "The page is hidden.";
  if (!document.hasFocus()) return "The page has lost the focus.";
  if (link.stale) return "No new picture.";
  return "";
}

function tick() {
  link.keep();
  const now = performance.now();
  const hold = reasonNotToDrive();
  if (hold || now - tickedAt > STALLED) hands.letGo();
  tickedAt = now;
  const velocity = hold ? null : hands.velocity();
  if (velocity) zeros = ZEROS;
  if (velocity || zeros > 0 || now - sentAt > LIFE) {
    link.drive(velocity ?? (zeros > 0 ? [0, 0, 0] : null), hold);
    if (!velocity && zeros > 0) zeros -= 1;
    sentAt = now;
  }
  part("picture").classList.toggle("stale", link.stale);
}

function show() {
  const words = state.stopped_by ? `${state.stopped_by} has pressed the red stop.`
    : state.obstacle || (state.gate ? state.gate.reason : "Ready.");
  if (words !== shown) part("status").textContent = shown = words;
  part("take").hidden = state.mine;
  part("stop").textContent = state.stopped_by ? "Let go" : "Stop";
  part("age").textContent = state.picture ? `${Math.round(1000 * state.picture[1])} ms` : "";
}

function letGo() {
  hands.letGo();
  tick();
}

function listen() {
  addEventListener("keydown", (event) => {
    if (event.code === "Escape" || event.code === "Space") { event.preventDefault(); link.ask("stop"); return; }
    if (event.target instanceof HTMLInputElement || event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
    if (hands.press(event.code)) { event.preventDefault(); tick(); }
  });
  addEventListener("keyup", (event) => { hands.release(event.code); });
  for (const name of ["blur", "pagehide", "freeze"]) addEventListener(name, letGo);
  document.addEventListener("visibilitychange", letGo);
  for (const button of document.querySelectorAll("[data-drive]")) {
    const direction = /** @type {HTMLElement} */ (button).dataset.drive ?? "";
    button.addEventListener("pointerdown", (event) => {
      /** @type {HTMLElement} */ (button).setPointerCapture(/** @type {PointerEvent} */ (event).pointerId);
      hands.hold(direction, direction);
      tick();
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
      button.addEventListener(name, () => hands.release(direction));
  }
  part("stop").addEventListener("click", () => link.ask(state.stopped_by ? "reset_stop" : "stop"));
  part("take").addEventListener("click", () => link.ask("take"));
  part("leave").addEventListener("click", async () => { await post("leave"); location.reload(); });
}

function enter() {
  clearInterval(ticks);
  link.hangUp();
  part("drive").hidden = true;
  part("enter").hidden = false;
}

function drive() {
  part("enter").hidden = true;
  part("drive").hidden = false;
  part("picture").focus();
  clearInterval(ticks);
  tickedAt = performance.now();
  ticks = setInterval(tick, TICK);
}

part("enterForm").addEventListener("submit", async (event) => {
  event.preventDefault();
  const fields = new FormData(part("enterForm"));
  try {
    await post("enter", { name: fields.get("name"), password: fields.get("password") });
    drive();
  } catch (error) {
    part("enterProblem").textContent = error.message;
  }
});
listen();
fetch("me").then((answer) => (answer.ok ? drive() : enter()));
