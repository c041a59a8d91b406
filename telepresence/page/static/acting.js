// @ts-check
/** How a press on a key of the page drives, for hands that cannot hold one.
 *
 *   hold    as long as it is pressed: driving.js does that. A press without a hand (a screen reader, a switch, a voice,
 *           Enter) cannot be held: it drives one step
 *   step    a press drives a piece of the way, or turns a piece
 *   click   a press drives at half speed for two seconds; the next one on the same key renews that, any other ends it
 *
 * Everything ends by itself, and with whatever makes the page let go. */

import { DIRECTIONS } from "./held.js";
import { settings } from "./settings.js";

const TURN = Math.PI / 12; // rad of a step: 15 degrees
const RENEWAL = 2000; // ms
const HOLDER = "acting";

export class Acting {
  /** @param {{hold: Function, release: Function, speed: number, turn: number}} held */
  constructor(held) {
    this.held = held;
    this.direction = "";
    this.until = 0;
  }

  /** Drive. @param {string} direction @param {string} mode @param {number} step m @param {number} now ms */
  press(direction, mode, step, now) {
    const parts = DIRECTIONS[direction];
    const pace = mode === "click" ? 0.5 : 1;
    const needed = parts[2] ? TURN / this.held.turn : step / this.held.speed;
    this.direction = direction;
    this.until = now + (mode === "click" ? RENEWAL : 1000 * needed);
    this.held.hold(HOLDER, parts.map((part) => part * pace));
  }

  end() {
    this.direction = "";
    this.held.release(HOLDER);
  }

  /** @param {number} now ms; to be called often */
  check(now) {
    if (this.direction && now >= this.until) this.end();
  }
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  const acting = new Acting(page.held);
  /** @param {Event} event @returns {string} the direction of the key that was pressed */
  const key = (event) => {
    const element = /** @type {Element | null} */ (event.target);
    return /** @type {HTMLElement | null} */ (element?.closest("[data-drive]"))?.dataset.drive ?? "";
  };
  const show = () => {
    for (const button of document.querySelectorAll("[data-drive]"))
      button.classList.toggle("acting", /** @type {HTMLElement} */ (button).dataset.drive === acting.direction);
  };
  // Before the keys' own listeners: where a press shall not hold, nothing holds.
  document.addEventListener("pointerdown", (event) => {
    if (acting.direction && key(event) !== acting.direction) { acting.end(); show(); page.send(); }
    if (key(event) && settings.get("acting") !== "hold") event.stopImmediatePropagation();
  }, true);
  document.addEventListener("click", (event) => {
    const direction = key(event);
    const byHand = event.detail > 0;
    if (!direction || (byHand && settings.get("acting") === "hold")) return;
    const refusal = page.refusal();
    if (refusal) { page.emit("said", refusal); return; }
    if (page.floorPoint) page.letGo(); // who started last drives
    acting.press(direction, settings.get("acting"), settings.get("step"), performance.now());
    show();
    page.send();
  });
  page.on("letgo", () => { acting.end(); show(); });
  page.on("tick", () => {
    const before = acting.direction;
    acting.check(performance.now());
    if (before !== acting.direction) show();
  });
}
