// @ts-check
/** What a screen reader says: the sentence of the status line, at most once a second; why the robot is stopped, at once. */

import { text } from "./language.js";
import { part } from "./page.js";

const PERIOD = 1000; // ms between two announcements

/** @param {import("./page.js").Page} page */
export function start(page) {
  let [politely, urgently] = ["", ""];
  let saidAt = -Infinity;
  const urgent = () => {
    if (page.state?.stopped_by) return text("driving.stopped_by", { name: page.state.stopped_by });
    return page.stale && page.state ? page.reasons.get("picture")?.() ?? "" : "";
  };
  page.on("tick", () => {
    const now = performance.now();
    if (now - saidAt < PERIOD) return;
    const words = urgent();
    if (words !== urgently) part("urgent").textContent = urgently = words;
    else if (part("status").textContent !== politely && !words) part("polite").textContent = politely = part("status").textContent;
    else return;
    saidAt = now;
  });
}
