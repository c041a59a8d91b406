// @ts-check
/** Hold on the floor in the picture and the robot goes there, for as long as it is held. Where that is on the ground is
 * computed at the station, for the time when the picture was taken: see telepresence/page/floor.py. */

import { text } from "./language.js";
import { part } from "./page.js";

const STILL = 250; // ms that a pointer stays where it came down before it points at the floor: else it turns the head
const MOVED = 12; // px

/**
 * Where somebody holds: shares of the picture, from its left and from its top; the number of the press; when the picture
 * was taken, by the station's clock [s], or null for the newest one.
 * @typedef {{at: [number, number], press: number, stamp: number | null}} Point
 */

/**
 * @param {{left: number, top: number, width: number, height: number}} box of the picture on the screen
 * @param {number} x @param {number} y @returns {[number, number] | null} shares of the picture; null beside it
 */
export function share(box, x, y) {
  const [u, v] = [(x - box.left) / box.width, (y - box.top) / box.height];
  return u >= 0 && u <= 1 && v >= 0 && v <= 1 ? [u, v] : null;
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  const picture = part("picture");
  /** @type {{id: number, x: number, y: number, timer: number} | null} */
  let pointer = null;
  let presses = 0;

  const forgo = () => {
    if (pointer) clearTimeout(pointer.timer);
    page.floorAwaited = false;
  };
  const end = () => {
    forgo();
    pointer = null;
    page.floorPoint = null;
    if (page.pictureHand === "floor") page.pictureHand = "";
  };
  const point = (/** @type {number} */ x, /** @type {number} */ y) => {
    const at = share(picture.getBoundingClientRect(), x, y);
    if (!at) return;
    page.floorPoint = { at, press: presses, stamp: page.pictureStamp?.() ?? null };
  };
  const hold = () => {
    page.floorAwaited = false;
    if (!pointer || page.pictureHand) return;
    const refusal = page.refusal();
    if (refusal) { page.emit("said", refusal); return; }
    const holds = pointer;
    if (page.held.velocity()) page.letGo(); // who started last drives
    pointer = holds; // that has let go of this press, too
    page.pictureHand = "floor";
    presses += 1;
    point(holds.x, holds.y);
    page.send();
  };

  page.on("letgo", end);
  picture.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
    if (pointer || event.button !== 0 || !page.me) return;
    picture.setPointerCapture(event.pointerId);
    pointer = { id: event.pointerId, x: event.clientX, y: event.clientY, timer: setTimeout(hold, STILL) };
    page.floorAwaited = true;
  });
  picture.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
    if (pointer?.id !== event.pointerId) return;
    if (page.pictureHand === "floor") point(event.clientX, event.clientY);
    else if (!page.state?.head) [pointer.x, pointer.y] = [event.clientX, event.clientY]; // no head to turn: it points, too
    else if (Math.hypot(event.clientX - pointer.x, event.clientY - pointer.y) > MOVED) forgo();
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
    picture.addEventListener(name, (/** @type {PointerEvent} */ event) => {
      if (pointer?.id !== event.pointerId) return;
      const held = page.floorPoint !== null;
      const moved = Math.hypot(event.clientX - pointer.x, event.clientY - pointer.y) > MOVED;
      if (name === "pointerup" && !page.pictureHand && !moved && page.state?.mine) page.emit("said", text("floor.clicked"));
      end();
      if (held) page.send();
    });
  picture.addEventListener("contextmenu", (/** @type {Event} */ event) => event.preventDefault());
}
