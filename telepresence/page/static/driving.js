// @ts-check
/** Driving by keys and by the buttons on the screen, the red stop, and when a page must not drive. */

import { Patience } from "./delay.js";
import { DIRECTIONS, SPEED_STEP } from "./held.js";
import { text } from "./language.js";
import { part } from "./page.js";

/** By place on the keyboard, whatever letter is printed there; as in the window. */
const KEYS = {
  KeyW: "forward", KeyS: "back", KeyA: "left", KeyD: "right", KeyQ: "turn_left", KeyE: "turn_right",
  ArrowUp: "forward", ArrowDown: "back", ArrowLeft: "turn_left", ArrowRight: "turn_right",
};
/** Keys -> steps of the speed. */
const FASTER = { PageUp: 1, PageDown: -1, Minus: -1, Equal: 1, NumpadSubtract: -1, NumpadAdd: 1 };
const PANIC = 1000; // ms after a stop in which another press does not reset it: people in a panic press twice

/** @param {import("./page.js").Page} page */
export function start(page) {
  watchPictures(page);
  page.reasons.set("hidden", () => (document.hidden ? text("driving.hidden") : ""));
  page.reasons.set("focus", () => (document.hasFocus() ? "" : text("driving.no_focus")));
  page.reasons.set("picture", () =>
    page.link.stale ? text(page.link.dark ? "driving.dark" : "driving.no_picture") : page.stale ? text("driving.old_picture") : "");
  page.reasons.set("delay", () => (page.delay.share(performance.now()) ? "" : text("driving.too_slow")));
  for (const name of ["blur", "pagehide", "freeze"]) addEventListener(name, () => letGo(page));
  document.addEventListener("visibilitychange", () => letGo(page));
  document.addEventListener("fullscreenchange", () => {
    // Esc leaves the full screen before the page hears of it, and Esc is the red stop.
    if (!document.fullscreenElement && page.holds) page.ask("stop");
    else page.letGo();
  });
  document.addEventListener("focusin", (event) => { if (isText(event.target) && page.holds) page.letGo(); });
  listenToKeys(page);
  for (const button of document.querySelectorAll("[data-drive]")) listenToButton(page, /** @type {any} */ (button));
  const stopped = watchStop(page);
  // Down, not click: the second finger on a screen makes no clicks. The click that ends a press which has stopped the robot
  // does not reset the stop, however long the press was; one without a press comes from a key or a scan.
  let pressStops = false;
  part("stop").addEventListener("pointerdown", () => {
    pressStops = !page.state?.stopped_by;
    if (pressStops) page.ask("stop");
  });
  part("stop").addEventListener("click", (event) => {
    if (pressStops && event.detail > 0 && page.state?.stopped_by) return;
    page.ask(stopped.mayReset() ? "reset_stop" : "stop");
  });
}

/** Let go, and say why if that ends something. @param {import("./page.js").Page} page */
function letGo(page) {
  const held = page.holds;
  page.letGo();
  if (held && page.obstacle()) page.emit("said", page.obstacle());
}

/** @param {import("./page.js").Page} page */
function watchPictures(page) {
  const patience = new Patience();
  page.pauses.set("late", () => (patience.late(performance.now()) ? text("driving.late_picture") : ""));
  page.on("robot", () => patience.forget());
  page.on("tick", () => patience.note(page.link.pictureAt));
  page.on("state", () => {
    const age = page.pictureAge();
    if (age !== null && age >= 0) page.delay.note("picture", 1000 * age, performance.now());
    if (page.state.top) page.held.setTop(page.state.top[0], page.state.top[1]);
  });
}

/** @param {import("./page.js").Page} page */
function watchStop(page) {
  let since = -Infinity;
  let was = "";
  page.on("state", () => {
    const by = page.state.stopped_by;
    if (by && !was) since = performance.now();
    was = by;
    const words = text(by ? "driving.reset_stop" : "driving.stop");
    if (part("stop").textContent !== words) part("stop").textContent = words;
    part("stop").setAttribute("aria-pressed", String(Boolean(by)));
  });
  return { mayReset: () => Boolean(page.state?.stopped_by) && performance.now() - since > PANIC };
}

/** @param {EventTarget | null} target @returns {boolean} whether it takes letters itself */
export function isText(target) {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement) return !["checkbox", "radio", "range", "button"].includes(target.type);
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement || target.isContentEditable;
}

/** @param {EventTarget | null} target @param {string} code @returns {boolean} whether it needs this key itself */
function needs(target, code) {
  if (isText(target)) return code !== "Escape";
  if (!(target instanceof HTMLInputElement)) return false;
  if (target.type === "range") return code.startsWith("Arrow") || code.startsWith("Page");
  return code === "Space" || (target.type === "radio" && code.startsWith("Arrow"));
}

/** @param {import("./page.js").Page} page */
function listenToKeys(page) {
  addEventListener("keydown", (event) => {
    const stops = event.code === "Escape" || event.code === "Space";
    if (!page.me || (needs(event.target, event.code) && !(stops && page.holds))) return; // who drives stops, wherever the focus is
    if (stops) {
      event.preventDefault();
      if (!event.repeat) page.ask("stop");
      return;
    }
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (FASTER[event.code]) { event.preventDefault(); page.held.setSpeed(page.held.speed + FASTER[event.code] * SPEED_STEP); return; }
    const direction = KEYS[event.code];
    if (!direction) return;
    event.preventDefault();
    if (!event.repeat) press(page, event.code, direction);
  });
  addEventListener("keyup", (event) => {
    // On a Mac no key comes up while the command key is down.
    if (event.key === "Meta") page.letGo();
    release(page, event.code);
  });
}

/** @param {import("./page.js").Page} page @param {string} holder @param {string} direction */
export function press(page, holder, direction) {
  const refusal = page.refusal();
  if (refusal) {
    page.emit("said", refusal);
    return;
  }
  if (page.floorPoint) page.letGo(); // who started last drives
  page.held.hold(holder, DIRECTIONS[direction]);
  show(page, direction);
  page.send();
}

/** @param {import("./page.js").Page} page @param {string} holder */
export function release(page, holder) {
  if (!page.held.holders.has(holder)) return;
  page.held.release(holder);
  show(page);
  page.send();
}

/** A thumb that held a button slides: the button is let go. @param {import("./page.js").Page} page */
export function releaseButtons(page) {
  for (const direction of Object.keys(DIRECTIONS)) page.held.release(direction);
  show(page);
}

/** Show which buttons are held. @param {import("./page.js").Page} page @param {string} [more] */
function show(page, more) {
  const held = new Set([...page.held.holders.keys()].map((holder) => KEYS[holder] ?? holder));
  if (more) held.add(more);
  for (const button of document.querySelectorAll("[data-drive]"))
    button.classList.toggle("held", held.has(/** @type {HTMLElement} */ (button).dataset.drive ?? ""));
}

/** @param {import("./page.js").Page} page @param {HTMLElement} button */
function listenToButton(page, button) {
  const direction = button.dataset.drive ?? "";
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    press(page, direction, direction);
  });
  button.addEventListener("contextmenu", (event) => event.preventDefault()); // a long press is driving
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
    button.addEventListener(name, () => release(page, direction));
  page.on("letgo", () => button.classList.remove("held"));
}
