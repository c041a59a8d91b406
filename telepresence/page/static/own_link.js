// @ts-check
/** The link that the station itself prints where nobody signs in: it lets in, without a question, whoever has started it. */

import { post } from "./link.js";
import { isOwed, setOwed, signOut } from "./signing_out.js";

/** Come in by the address bar's key, and leave no trace of it there. */
export async function comeInByOwnLink() {
  const found = /^#k=([\w-]{1,100})$/.exec(location.hash);
  if (!found) return;
  history.replaceState(null, "", location.pathname + location.search); // at once: it must stay in no history
  try {
    if (isOwed()) await signOut();
    await post("enter", { name: "", invitation: found[1] });
    setOwed(false); // the cookie of before is replaced
  } catch (error) {
    console.warn(error.message); // of a station that has ended: the page asks who it is
  }
}
