// @ts-check
/** Several robots behind one page: each is one tap away. Who looks through another one lets the first go. Where this page
 * is one of a site's, a link leads back to the list of all robots. */

import { text } from "./language.js";
import { part } from "./page.js";

const KEPT = "robot"; // in the tab's storage: a page that is loaded again looks through the same robot

/** @param {import("./page.js").Page} page */
export function start(page) {
  page.robot = sessionStorage.getItem(KEPT) ?? "";
  const choice = document.createElement("div");
  choice.id = "robots";
  choice.setAttribute("role", "group");
  choice.setAttribute("aria-label", text("robots.choice"));
  part("facts").prepend(choice);
  const name = siteName(location.pathname);
  if (name) choice.before(linkToSite(name));
  let shown = "";
  let arrived = false; // at a robot whose drive_lease has not let this page join yet

  page.on("entered", () => {
    const robots = page.me?.robots ?? [];
    choice.hidden = robots.length < 2;
    choice.replaceChildren(...robots.map((robot) => button(page, robot)));
  });
  page.on("robot", () => {
    arrived = true;
    sessionStorage.setItem(KEPT, page.robot);
    document.title = text("robots.title", { robot: name || page.robot });
    for (const each of choice.children)
      each.setAttribute("aria-pressed", String(/** @type {HTMLElement} */ (each).dataset.robot === page.robot));
    // Nobody takes the last picture of one robot for the first of the other.
    if (shown && shown !== page.robot) part("picture").srcObject = null;
    shown = page.robot;
  });
  page.on("state", () => {
    if (!arrived || !page.state.joined || document.hidden) return;
    arrived = false;
    // Whoever comes here wants to drive here: not in the window, nor in the page, where the same person was before.
    if (!page.state.mine && page.state.pilot === page.me?.name) page.ask("take");
  });
  page.on("left", () => { document.title = text("robots.nobody"); });
}

/** What the site calls this robot: its page is https://SITE/NAME/. @param {string} path */
export const siteName = (path) => path.split("/").at(-2) ?? "";

/** @param {string} name */
function linkToSite(name) {
  const link = document.createElement("a");
  link.id = "site";
  link.href = "../";
  link.textContent = name;
  link.setAttribute("aria-label", text("robots.site", { robot: name }));
  return link;
}

/** @param {import("./page.js").Page} page @param {string} robot */
function button(page, robot) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = made.dataset.robot = robot;
  made.addEventListener("click", () => { if (page.robot !== robot) page.look(robot); });
  return made;
}
