// @ts-check
/** Who drives: take the robot or ask for it, hand it over or keep it, leave it to others. */

import { text } from "./language.js";
import { part } from "./page.js";

/** @param {string} id @param {() => void} onClick */
function button(id, onClick) {
  const made = document.createElement("button");
  made.type = "button";
  made.id = id;
  made.hidden = true;
  made.addEventListener("click", onClick);
  return made;
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  const take = part("take");
  take.addEventListener("click", () => page.ask("take"));
  const give = button("give", () => page.ask("give", ""));
  const keep = button("keep", () => page.ask("keep"));
  const release = button("release", () => page.ask("release"));
  give.className = "primary";
  keep.textContent = text("driving.keep");
  release.textContent = text("driving.release");
  part("actions").append(give, keep);
  page.section("driving", text("driving.title")).append(release);
  let asking = "";
  let lost = false; // the robot, to somebody: not by what we did ourselves
  page.on("robot", () => { asking = ""; });
  page.on("state", () => {
    const { mine, pilot, asking: who } = page.state;
    const asks = mine ? who : "";
    if (asks && asks !== asking) page.emit("said", text("driving.asks", { name: asks }));
    asking = asks;
    take.hidden = mine || page.me?.role === "watcher";
    const words = text(pilot ? "driving.ask" : "driving.take");
    if (take.textContent !== words) take.textContent = words;
    give.hidden = keep.hidden = !asks;
    if (asks) give.textContent = text("driving.give", { name: asks });
    release.hidden = !mine;
    if (lost && mine) page.letGo(); // a key that was held for nothing must not begin to drive
    lost = !mine;
  });
}
