// @ts-check
/** Why the robot takes nothing of the pilot's microphone or camera. No DOM. */

/** What the state calls it -> what the texts do. */
const DEVICES = { speak: "microphone", face: "camera" };

/**
 * @param {import("./page.js").Page} page @param {"speak" | "face"} takes what the robot would have to do
 * @returns {"" | "connection" | "robot" | "way" | "program"} "" for nothing: it takes it
 */
export function hindrance({ state, silent }, takes) {
  if (!state || silent) return "connection";
  if (!state.mine) return "robot";
  if (!state.sound) return "way"; // the one without WebRTC
  return state.sound[takes] ? "" : "program";
}

/** Name of what is said to somebody who wants to open a device all the same. @param {string} why a hindrance */
export const refusedBecause = (why) => (why === "connection" ? "connection.none" : "sound.take_first");

/** Name of the text for a device that was open until then. @param {"speak" | "face"} takes @param {string} why a hindrance */
export const offBecause = (takes, why) => `sound.${DEVICES[takes]}_off_${why}`;
