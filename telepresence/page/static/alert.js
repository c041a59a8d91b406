// @ts-check
/** What is said to the pilot. Sentences that come close together stand below each other: of two that come with the loss
 * of the robot, nobody could read the first one otherwise. */

import { show } from "./language.js";
import { part } from "./page.js";

const READ = 4000; // ms for which a sentence makes no room for the next one
const MOST = 3; // sentences at once

/** @param {import("./page.js").Page} page */
export function start(page) {
  /** @type {{words: string, at: number}[]} */
  let said = [];
  page.on("said", (event) => {
    const at = performance.now();
    const others = said.filter((one) => at - one.at < READ && one.words !== event.detail);
    said = [...others, { words: event.detail, at }].slice(-MOST);
    // Also those that stand there already: a screen reader says the alert as a whole.
    part("alert").replaceChildren(...said.map(({ words }) => {
      const line = document.createElement("span");
      show(line, words);
      return line;
    }));
  });
}
