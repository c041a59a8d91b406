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

/** Name of the text for a device that is off for this reason. @param {"speak" | "face"} takes @param {string} why a hindrance */
export const offBecause = (takes, why) => `sound.${DEVICES[takes]}_off_${why}`;

/** Name of what is said to somebody who wants to open it all the same. @param {"speak" | "face"} takes @param {string} why a hindrance */
export const refusedBecause = (takes, why) => (why === "connection" ? "connection.none" : why === "robot" ? "sound.take_first" : offBecause(takes, why));
