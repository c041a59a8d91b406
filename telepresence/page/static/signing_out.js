// @ts-check
/** Signing out at the station. Only the station can end a sign-in and take its cookie back: as long as it has not
 * answered, it is asked again, and nobody comes in here by the old cookie. */

import { NotSignedIn, post } from "./link.js";

const STORE = "signing_out"; // in the browser: a page that is loaded again goes on with it
const PATIENCE = 5000; // ms for an answer
const PERIOD = 2000; // ms between two attempts

let owedHere = false; // in a browser that keeps nothing
/** @type {Promise<boolean> | null} the attempt that is on its way */
let attempt = null;

/** Whether somebody has signed out here and the station has not confirmed it. */
export function isOwed() {
  try {
    return owedHere || localStorage.getItem(STORE) !== null;
  } catch {
    return owedHere;
  }
}

/** Somebody has signed out: what the station has to hear; or it has. @param {boolean} owed */
export function setOwed(owed) {
  owedHere = owed;
  try {
    if (owed) localStorage.setItem(STORE, "1");
    else localStorage.removeItem(STORE);
  } catch { /* a browser that keeps nothing */ }
}

/** Ask the station once. @returns {Promise<boolean>} whether nobody is signed in any more */
export function signOut() {
  if (attempt) return attempt;
  const given = new AbortController(); // AbortSignal.timeout is newer than some browsers
  const timer = setTimeout(() => given.abort(), PATIENCE);
  attempt = post("leave", {}, given.signal, true)
    .finally(() => clearTimeout(timer))
    .then(() => true, (error) => error instanceof NotSignedIn) // it has ended, or nobody knows the cookie
    .then((done) => {
      attempt = null;
      if (done) setOwed(false);
      return done;
    });
  return attempt;
}

/** Ask the station until nobody is signed in any more. @param {() => void} onFailed each attempt that was in vain */
export async function keepSigningOut(onFailed) {
  while (isOwed() && !await signOut()) {
    onFailed();
    await new Promise((resolve) => setTimeout(resolve, PERIOD));
  }
}
