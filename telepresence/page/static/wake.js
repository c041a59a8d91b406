// @ts-check
/** The screen of a phone stays on while somebody is in: a screen that goes dark stops the robot. */

/** @param {import("./page.js").Page} page */
export function start(page) {
  /** @type {WakeLockSentinel | null} */
  let lock = null;
  const keep = async () => {
    if (!page.me || document.hidden || (lock && !lock.released) || !("wakeLock" in navigator)) return;
    try {
      lock = await navigator.wakeLock.request("screen");
    } catch (error) {
      // Saving energy comes first on some phones; then the screen goes dark as for any other page, and the robot stops.
      if (!(error instanceof DOMException)) throw error;
    }
  };
  page.on("entered", keep);
  page.on("left", () => lock?.release());
  document.addEventListener("visibilitychange", keep); // a hidden page loses it
}
