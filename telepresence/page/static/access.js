// @ts-check
/** Ways to act for those who cannot hold a key: what can be chosen in the sheet. */

import { start as startActing } from "./acting.js";
import { start as startDwelling } from "./dwelling.js";
import { start as startScanning } from "./scanning.js";
import { choice, make, slider } from "./controls.js";
import { text } from "./language.js";
import { settings } from "./settings.js";

/** @param {import("./page.js").Page} page */
export function start(page) {
  startScanning(page);
  startActing(page);
  startDwelling(page);
  const seconds = (/** @type {number} */ value) => text("access.seconds", { s: value.toFixed(1) });
  page.section("access", text("access.title")).append(
    choice(text("access.acting"), ["hold", "step", "click"].map((name) => [name, text(`access.acting_${name}`)]),
      settings.get("acting"), (value) => settings.set("acting", value)),
    slider(text("access.step"), { min: 0.1, max: 0.3, step: 0.05 }, settings.get("step"),
      (value) => text("access.metres", { m: value.toFixed(2) }), (value) => settings.set("step", value)),
    choice(text("access.without"), ["neither", "scanning", "dwelling"].map((name) => [name, text(`access.${name}`)]),
      ["scanning", "dwelling"].find((name) => settings.get(name)) ?? "neither",
      (value) => { for (const name of ["scanning", "dwelling"]) settings.set(name, name === value); }),
    make("p", { className: "quiet" }, text("access.scanning_how")),
    slider(text("access.scan_time"), { min: 0.5, max: 3, step: 0.1 }, settings.get("scanTime"), seconds,
      (value) => settings.set("scanTime", value)),
    make("p", { className: "quiet" }, text("access.dwelling_how")),
    slider(text("access.dwell_time"), { min: 0.4, max: 2, step: 0.1 }, settings.get("dwellTime"), seconds,
      (value) => settings.set("dwellTime", value)),
  );
}
