// @ts-check
/** The page by one switch: a frame goes from group to group, the switch enters one, the frame goes through it, the switch
 * presses. While the robot moves the switch does one thing: it stops it. The switch is Space, Enter, a press on the
 * picture, or any button of a gamepad but B, which is the red stop. */

import { settings } from "./settings.js";
import { groups, press } from "./targets.js";

const STEP = 50; // ms between two looks at the clock
const ROUNDS = 2; // through a group without a press, then back to the groups
const BOUNCE = 150; // ms within which a trembling switch counts once

/** Which target is framed. No clock, no DOM: targets are whatever it is given. @template Target */
export class Scan {
  constructor() {
    /** @type {Target | null} the first of the group that was entered: groups come and go, so no index is kept */
    this.entered = null;
    /** @type {Target[]} */
    this.framed = [];
    this.steps = 0;
  }

  /** Frame the next. @param {Target[][]} all groups, that of the red stop first */
  step(all) {
    const inside = this.inside(all);
    if (inside) {
      const items = [...inside, ...all[0]];
      this.steps += 1;
      if (this.steps > ROUNDS * items.length) this.back(all);
      else this.framed = [items[(items.indexOf(this.framed[0]) + 1) % items.length]];
    } else {
      this.entered = null;
      const now = all.findIndex((group) => group.includes(this.framed[0]));
      this.framed = all[(now + 1) % all.length] ?? [];
    }
  }

  /** The switch. @param {Target[][]} all @returns {Target | null} what it presses */
  press(all) {
    this.steps = 0;
    const inside = this.inside(all);
    if (!inside && this.framed.length > 1) {
      this.entered = this.framed[0];
      this.framed = [this.framed[0]];
      return null;
    }
    const target = this.framed[0] ?? null;
    if (inside && target !== null && !inside.includes(target)) this.entered = null; // the red stop: begin again
    return target;
  }

  /** Leave a group, and frame it as a whole. @param {Target[][]} all */
  back(all) {
    this.framed = this.inside(all) ?? [];
    this.entered = null;
    this.steps = 0;
  }

  /** Begin again, with the red stop. */
  restart() {
    this.entered = null;
    this.framed = [];
    this.steps = 0;
  }

  /** @param {Target[][]} all @returns {Target[] | undefined} the group that was entered, if it is still there */
  inside(all) {
    return this.entered === null ? undefined : all.find((group) => group.includes(/** @type {Target} */ (this.entered)));
  }
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  /** @type {Scan<HTMLElement>} */
  const scan = new Scan();
  let [steppedAt, pressedAt] = [0, -Infinity];

  const frame = () => {
    for (const element of document.querySelectorAll(".scanned")) element.classList.remove("scanned");
    for (const element of scan.framed) element.classList.add("scanned");
    scan.framed[0]?.scrollIntoView({ block: "nearest" });
  };
  const moving = () => page.holds;
  const onSwitch = () => {
    const now = performance.now();
    if (now - pressedAt < BOUNCE) return;
    pressedAt = steppedAt = now;
    if (moving()) {
      page.letGo();
      scan.restart();
      scan.step(groups());
    } else {
      const target = scan.press(groups());
      if (target) press(target);
    }
    frame();
  };
  const tick = () => {
    if (!settings.get("scanning")) return;
    const now = performance.now();
    if (moving()) steppedAt = now; // the frame waits
    else if (now - steppedAt >= 1000 * settings.get("scanTime")) {
      steppedAt = now;
      scan.step(groups());
      frame();
    }
  };
  /** @param {KeyboardEvent} event */
  const onKey = (event) => {
    if (!settings.get("scanning") || !["Space", "Enter", "NumpadEnter"].includes(event.code)) return;
    if (event.target instanceof HTMLTextAreaElement || (event.target instanceof HTMLInputElement && event.target.type === "text")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (event.type === "keydown" && !event.repeat) onSwitch();
  };
  addEventListener("keydown", onKey, true);
  addEventListener("keyup", onKey, true);
  document.getElementById("stage")?.addEventListener("pointerdown", (event) => {
    if (!settings.get("scanning")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    onSwitch();
  }, true);
  page.on("switch", () => { if (settings.get("scanning")) onSwitch(); });
  settings.addEventListener("change", () => {
    scan.restart();
    frame();
  });
  setInterval(tick, STEP);
}
