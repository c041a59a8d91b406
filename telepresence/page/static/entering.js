// @ts-check
/** Coming in: by name and password, by a link, or by a name alone where the station asks nobody who they are. */

import { show as showWords, text } from "./language.js";
import { get, post } from "./link.js";
import { part } from "./page.js";
import { isOwed, keepSigningOut, signOut } from "./signing_out.js";

/** Of a link that was opened; in memory alone. */
let invitation = "";

/** Take the secret out of the address bar, before anything else: it must stay in no history. */
function takeLink() {
  const found = /^#i=([\w-]{1,100})$/.exec(location.hash);
  if (!found) return false;
  invitation = found[1];
  history.replaceState(null, "", location.pathname + location.search);
  return true;
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  takeLink();
  const form = part("enterForm");
  form.addEventListener("submit", async (/** @type {Event} */ event) => {
    event.preventDefault();
    const fields = new FormData(form);
    const name = fields.get("name");
    const button = form.querySelector("button.primary");
    button.disabled = true;
    part("enterProblem").textContent = "";
    try {
      if (isOwed() && !await signOut()) throw new Error(text("entering.still_in"));
      const me = await post("enter", invitation ? { name, invitation } : { name, password: fields.get("password") });
      invitation = "";
      form.elements.password.value = "";
      if (!page.me) page.enter(me); // unless the page has found the new cookie first
    } catch (error) {
      showWords(part("enterProblem"), error instanceof TypeError ? text("connection.none") : error.message);
      form.elements.name.focus(); // which a disabled button has lost
    }
    button.disabled = false;
  });
  part("leave").addEventListener("click", () => page.signOut());
  page.on("entered", () => show(true));
  page.on("left", () => { show(false); askWhoItIs(page); });
  addEventListener("hashchange", () => { if (takeLink() && !page.me) askWhoItIs(page); });
  askWhoItIs(page);
}

/** Come in again with the cookie of before, unless it was given up; else show what is needed. @param {import("./page.js").Page} page */
async function askWhoItIs(page) {
  if (isOwed()) {
    show(false);
    await keepSigningOut(() => showWords(part("enterProblem"), text("entering.still_in")));
    if (page.me) return; // somebody has come in meanwhile
  }
  let me;
  try {
    me = await get("me");
  } catch (error) {
    if (!page.me) ask(error.fields ?? { password: true });
    return;
  }
  if (page.me) return;
  invitation = ""; // whoever is in needs no second way in
  page.enter(me);
}

/** @param {{password: boolean, ended?: string, hint?: string}} needs what the station says to somebody who is not in */
function ask({ password, ended, hint }) {
  part("enterTitle").textContent = text(invitation ? "entering.invited" : "entering.title");
  showWords(part("enterProblem"), ended ?? hint ?? "");
  part("enterPassword").hidden = Boolean(invitation) || !password;
  const name = part("enterForm").elements.name;
  name.required = !invitation && password;
  name.autocomplete = invitation ? "nickname" : "username";
  show(false);
  if (!part("enterForm").contains(document.activeElement)) name.focus(); // else somebody types already
}

/** @param {boolean} entered */
function show(entered) {
  part("enter").hidden = entered;
  part("drive").hidden = !entered;
  if (entered) part("picture").focus();
}
