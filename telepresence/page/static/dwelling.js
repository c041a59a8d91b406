// @ts-check
/** Resting presses: for gaze and head mice, whose pointer trembles and comes late. The pointer is smoothed, the nearest
 * target within reach counts, and it is pressed when the pointer has rested on it; the red stop sooner. A key that drives
 * is pressed again and again while the pointer rests on it, everything else once. */

import { settings } from "./settings.js";
import { press, targets } from "./targets.js";

const STEP = 33; // ms
const SMOOTH = 200; // ms: time constant of the smoothed pointer
const JUMP = 240; // px from the smoothed pointer: it has gone elsewhere, and is believed at once
const REACH = 28; // px around a target that still belong to it
const HOLDS = 60; // px around it within which it is not lost to nothing
const STOP = 300; // ms to rest on the red stop
const FORGET = 250; // ms away from a target after which its time begins anew

/** A pointer that trembles, smoothed. No DOM. */
export class Smoothed {
  constructor() {
    /** @type {{x: number, y: number} | null} */
    this.place = null;
    this.at = 0;
  }

  /** @param {number} x @param {number} y @param {number} now ms */
  move(x, y, now) {
    const place = this.place;
    if (!place || Math.hypot(x - place.x, y - place.y) > JUMP) this.place = { x, y };
    else {
      const share = 1 - Math.exp(-Math.max(0, now - this.at) / SMOOTH);
      this.place = { x: place.x + share * (x - place.x), y: place.y + share * (y - place.y) };
    }
    this.at = now;
  }
}

/** Which target the pointer rests on, and for how long. Each has a box. No DOM. @template Target */
export class Rest {
  constructor() {
    /** @type {Target | null} */
    this.on = null;
    this.time = 0; // ms on it
    this.lostAt = 0;
    this.pressed = false;
  }

  /**
   * @param {{x: number, y: number} | null} place @param {{target: Target, left: number, top: number, right: number, bottom: number}[]} boxes
   * @param {number} passed ms since the last call @param {number} now ms
   */
  look(place, boxes, passed, now) {
    const near = place ? boxes.map((box) => ({ target: box.target, far: distance(place, box) })).sort((a, b) => a.far - b.far) : [];
    const own = near.find((box) => box.target === this.on);
    const best = near[0];
    const stays = own && own.far <= HOLDS && own.far - best.far < REACH / 2;
    if (stays) {
      this.time += passed;
      this.lostAt = now;
    } else if (this.on !== null && now - this.lostAt < FORGET && !(best && best.far === 0)) {
      // A tremble: it neither counts nor costs.
    } else {
      this.on = best && best.far <= REACH ? best.target : null;
      this.time = 0;
      this.lostAt = now;
      this.pressed = false;
    }
  }
}

/** @param {{x: number, y: number}} place @param {{left: number, top: number, right: number, bottom: number}} box px from its edge */
function distance(place, box) {
  return Math.hypot(Math.max(box.left - place.x, 0, place.x - box.right), Math.max(box.top - place.y, 0, place.y - box.bottom));
}

/** @param {import("./page.js").Page} _page */
export function start(_page) {
  const smoothed = new Smoothed();
  /** @type {Rest<HTMLElement>} */
  const rest = new Rest();
  const ring = document.createElement("div");
  ring.id = "restRing";
  ring.hidden = true;
  document.body.append(ring);
  /** @type {{x: number, y: number} | null} */
  let raw = null;
  let lookedAt = 0;
  addEventListener("pointermove", (event) => { raw = event.pointerType === "touch" ? null : { x: event.clientX, y: event.clientY }; }, true);
  document.documentElement.addEventListener("pointerleave", () => { raw = null; });
  addEventListener("pointerdown", () => { rest.time = 0; }, true);

  /** @param {HTMLElement} target @param {number} share of the time */
  const show = (target, share) => {
    ring.hidden = share <= 0;
    const box = target.getBoundingClientRect();
    ring.style.left = `${(box.left + box.right) / 2}px`;
    ring.style.top = `${(box.top + box.bottom) / 2}px`;
    ring.style.setProperty("--share", String(share));
  };
  const look = () => {
    const now = performance.now();
    const passed = now - lookedAt;
    lookedAt = now;
    if (!settings.get("dwelling")) { ring.hidden = true; return; }
    if (raw) smoothed.move(raw.x, raw.y, now);
    else smoothed.place = null;
    rest.look(smoothed.place, targets(document.body).filter(uncovered).map(box), Math.min(passed, 2 * STEP), now);
    const target = rest.on;
    if (!target) { ring.hidden = true; return; }
    const needed = target.id === "stop" ? STOP : 1000 * settings.get("dwellTime");
    if (!rest.pressed && rest.time >= needed) {
      press(target);
      rest.time = 0;
      rest.pressed = !target.matches("[data-drive], [data-look]");
    }
    show(target, rest.pressed ? 0 : rest.time / needed);
  };
  setInterval(look, STEP);
}

/** Whether nothing lies over it. @param {HTMLElement} target */
function uncovered(target) {
  const { left, top, width, height } = target.getBoundingClientRect();
  const found = document.elementFromPoint(left + width / 2, top + height / 2);
  return found !== null && (target.contains(found) || Boolean(target.closest("label")?.contains(found)));
}

/** @param {HTMLElement} target */
function box(target) {
  const { left, top, right, bottom } = (target.closest("label") ?? target).getBoundingClientRect();
  return { target, left, top, right, bottom };
}
