// @ts-check
/** Why the robot takes nothing of the pilot's microphone or camera. No DOM. */

/** What the state calls it -> what the texts do. */
const DEVICES = { speak: "microphone", face: "camera" };

/**
 * @param {any} state of the page @param {"speak" | "face"} takes what the robot would have to do
 * @returns {"" | "robot" | "way" | "program"} "" for nothing: it takes it
 */
export function hindrance(state, takes) {
  if (!state?.mine) return "robot";
  if (!state.sound) return "way"; // the one without WebRTC
  return state.sound[takes] ? "" : "program";
}

/** Name of the text for a device that was open until then. @param {"speak" | "face"} takes @param {string} why a hindrance */
export const offBecause = (takes, why) => `sound.${DEVICES[takes]}_off_${why}`;
