// @ts-check
/** How fast: a slider with a button at each end, and what the pad and the keys do. */

import { SPEED_STEP } from "./held.js";
import { text } from "./language.js";

/** @param {import("./page.js").Page} page */
export function start(page) {
  const body = page.section("driving", text("driving.title"));
  const label = document.createElement("label");
  const words = document.createElement("span");
  const row = document.createElement("div");
  const slider = document.createElement("input");
  label.htmlFor = slider.id = "speed";
  label.append(words);
  row.className = "speeds";
  slider.type = "range";
  slider.min = slider.step = String(SPEED_STEP);
  const help = ["help_hand", "help_keys", "help_floor"].map((name) => {
    const words = document.createElement("p");
    words.className = `quiet ${name}`;
    words.textContent = text(`driving.${name}`);
    return words;
  });
  const show = () => {
    slider.max = String(page.held.topSpeed);
    slider.value = String(page.held.speed);
    const speed = text("driving.speed", { speed: page.held.speed.toFixed(2) });
    if (words.textContent !== speed) words.textContent = speed;
    slider.setAttribute("aria-valuetext", speed);
  };
  const step = (/** @type {number} */ steps, /** @type {string} */ name, /** @type {string} */ sign) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "round";
    button.textContent = sign;
    button.setAttribute("aria-label", text(name));
    button.addEventListener("click", () => { page.held.setSpeed(page.held.speed + steps * SPEED_STEP); show(); });
    return button;
  };
  slider.addEventListener("input", () => { page.held.setSpeed(Number(slider.value)); show(); });
  row.append(step(-1, "driving.slower", "−"), slider, step(1, "driving.faster", "+"));
  body.append(label, row, ...help);
  page.on("state", show);
  show();
}
