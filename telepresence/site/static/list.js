// @ts-check
/** The list of robots: which of them are there, and the link by which somebody came, handed on to the robot's page. */

import { answers, translate, word } from "./words.js";

const PERIOD = 3000; // ms between two looks
const KEPT = "wayIn"; // in the tab's storage: who comes back to the list opens the next robot by the same link
const SECONDARY = 2; // the button that opens a menu, from which links are copied
const news = /** @type {HTMLElement} */ (document.getElementById("news"));
/** @type {HTMLElement[]} */
const states = [...document.querySelectorAll(".state")].map((each) => /** @type {HTMLElement} */ (each));

/** Take the link's secret out of the address bar: it must stay in no history. */
function takeLink() {
  if (/^#[ik]=[\w-]{1,100}(&i=[\w-]{1,100})?$/.test(location.hash)) {
    sessionStorage.setItem(KEPT, location.hash);
    history.replaceState(null, "", location.pathname);
  }
  for (const state of states) {
    const link = /** @type {HTMLAnchorElement} */ (state.closest("a"));
    link.onclick = link.onauxclick = (event) => {
      if (event.button === SECONDARY) return;
      // The browser opens it here or in another tab, as it was pressed, and then the secret is gone again: it stands
      // in no link that could be copied.
      link.setAttribute("href", `${state.dataset.robot}/${wayInto(state)}`);
      setTimeout(() => link.setAttribute("href", `${state.dataset.robot}/`));
    };
  }
}

/** @param {HTMLElement} state
 * @returns {string} What the robot's page gets: of a link with a key the secret that it takes, if it takes one. Where
 * people sign in, a key counts as a failed try. An invitation alone may be that of any page, and goes to all. */
function wayInto(state) {
  const kept = sessionStorage.getItem(KEPT) ?? "";
  const ways = new URLSearchParams(kept.slice(1));
  if (!ways.has("k")) return kept;
  const name = state.dataset.opens ?? "";
  return ways.has(name) ? `#${name}=${ways.get(name)}` : "";
}

/** @param {HTMLElement} state */
async function look(state) {
  const there = String(await answers(`${state.dataset.robot}/`, PERIOD));
  if (state.dataset.there === there) return;
  const first = state.dataset.there === undefined;
  state.dataset.there = there;
  state.textContent = word(there === "true" ? "there" : "away_now");
  if (!first) news.textContent = `${state.parentElement?.querySelector(".name")?.textContent}: ${state.textContent}`;
}

function lookAtAll() {
  if (!document.hidden) states.forEach(look);
}

translate();
takeLink();
addEventListener("hashchange", takeLink);
addEventListener("pageshow", lookAtAll);
document.addEventListener("visibilitychange", lookAtAll);
setInterval(lookAtAll, PERIOD);
lookAtAll();
