// @ts-check
/** Thumbs: a thumb that is put on a pad and slides becomes a stick around the place where it came down. The pad's
 * buttons stay what they are: nobody has to slide. */

import { releaseButtons } from "./driving.js";
import { deflection } from "./held.js";
import { part } from "./page.js";

const SLIDE = 14; // px that a thumb moves before it is a stick
const REACH = 56; // px from the middle to full speed
const DEAD_ZONE = 0.15;

/**
 * Make a stick of a pad.
 * @param {HTMLElement} pad
 * @param {{begin: () => void, move: (right: number, up: number) => void, end: () => void}} listeners -1 to 1 each
 * @returns {() => void} ends what is held now
 */
export function stick(pad, listeners) {
  const ring = document.createElement("div");
  const knob = document.createElement("div");
  ring.className = "stick";
  ring.hidden = true;
  ring.setAttribute("aria-hidden", "true");
  ring.append(knob);
  pad.append(ring);
  /** @type {{id: number, x: number, y: number} | null} */
  let thumb = null;
  const end = () => {
    const was = !ring.hidden;
    ring.hidden = true;
    thumb = null;
    if (was) listeners.end();
  };
  pad.addEventListener("pointerdown", (event) => {
    if (thumb || event.button !== 0) return;
    // A button, or the icon in it, keeps the pointer for itself: it must hear that it is let go.
    if (!(/** @type {Element} */ (event.target).closest("button"))) pad.setPointerCapture(event.pointerId);
    thumb = { id: event.pointerId, x: event.clientX, y: event.clientY };
  });
  pad.addEventListener("pointermove", (event) => {
    if (thumb?.id !== event.pointerId) return;
    const [x, y] = [event.clientX - thumb.x, event.clientY - thumb.y];
    if (ring.hidden) {
      if (Math.hypot(x, y) < SLIDE) return;
      const box = pad.getBoundingClientRect();
      ring.style.left = `${thumb.x - box.left}px`;
      ring.style.top = `${thumb.y - box.top}px`;
      const slides = thumb;
      listeners.begin(); // which may let go of all that is held, and so of this thumb
      thumb = slides;
      ring.hidden = false;
    }
    const out = Math.min(1, Math.hypot(x, y) / REACH) / Math.max(1e-6, Math.hypot(x, y));
    knob.style.translate = `${x * out * REACH}px ${y * out * REACH}px`;
    listeners.move(deflection(x * out, DEAD_ZONE), deflection(-y * out, DEAD_ZONE));
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
    pad.addEventListener(name, (event) => { if (thumb?.id === /** @type {PointerEvent} */ (event).pointerId) end(); });
  return end;
}

/**
 * A pad whose sliding thumb drives.
 * @param {import("./page.js").Page} page @param {HTMLElement} pad @param {(right: number, up: number) => number[]} parts what it means
 */
function drivingStick(page, pad, parts) {
  const refused = () => {
    const refusal = page.refusal();
    if (refusal) page.emit("said", refusal);
    return Boolean(refusal);
  };
  let may = false;
  const end = stick(pad, {
    begin: () => {
      releaseButtons(page); // the one under the thumb
      may = !refused();
      if (may && page.floorPoint) page.letGo(); // who started last drives
    },
    move: (right, up) => { if (may) page.held.hold(pad.id, parts(right, up)); },
    end: () => { page.held.release(pad.id); page.send(); },
  });
  page.on("letgo", end);
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  drivingStick(page, part("pad"), (right, up) => [up, 0, -right]);
  // Where no head is to be turned the right thumb has a pad of its own, for going without turning.
  const aside = document.createElement("div");
  aside.id = "sidePad";
  aside.className = "pad";
  aside.hidden = true;
  aside.setAttribute("aria-hidden", "true"); // the buttons do the same
  aside.append(document.createElement("span"));
  part("pads").append(aside);
  drivingStick(page, aside, (right, up) => [up, -right, 0]);
  page.on("state", () => { aside.hidden = Boolean(page.state.head); });
}
