// @ts-check
/** Microphones, cameras and loudspeakers of this machine: what was chosen, what there is, and opening one of them. */

import { text } from "./language.js";

const STORE = "sound";
const DEFAULTS = { listen: true, volume: 1, headset: false, mirror: true, audioinput: "", audiooutput: "", videoinput: "" };

/** @typedef {typeof DEFAULTS} Choices */

/** What was chosen in this browser. @returns {Choices} */
export function choices() {
  try {
    return { ...DEFAULTS, ...JSON.parse(localStorage.getItem(STORE) ?? "{}") };
  } catch {
    return { ...DEFAULTS }; // a browser that keeps nothing, or kept something else
  }
}

/** @param {Partial<Choices>} change @returns {Choices} */
export function choose(change) {
  const chosen = { ...choices(), ...change };
  try {
    localStorage.setItem(STORE, JSON.stringify(chosen));
  } catch { /* a browser that keeps nothing */ }
  return chosen;
}

/** Why a microphone or camera cannot be opened, as a sentence. @param {unknown} error @returns {string} */
export function problem(error) {
  if (!navigator.mediaDevices) return text("sound.insecure");
  const name = error instanceof DOMException ? error.name : "";
  if (name === "NotAllowedError" || name === "SecurityError") return text("sound.denied");
  if (name === "NotFoundError" || name === "OverconstrainedError") return text("sound.no_device");
  if (name === "NotReadableError" || name === "AbortError") return text("sound.busy");
  return String(error instanceof Error ? error.message : error);
}

/** @param {"audio" | "video"} kind @param {Choices} chosen @returns {MediaTrackConstraints} */
export function constraints(kind, chosen) {
  const device = kind === "audio" ? chosen.audioinput : chosen.videoinput;
  const wanted = device ? { deviceId: { exact: device } } : {};
  if (kind === "video") return { ...wanted, width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 15, max: 30 }, ...(device ? {} : { facingMode: "user" }) };
  // The browser removes from the microphone what its own loudspeaker plays; with a headset there is nothing to remove.
  const cleaned = !chosen.headset;
  return { ...wanted, channelCount: 1, echoCancellation: cleaned, noiseSuppression: cleaned, autoGainControl: cleaned };
}

/**
 * Open the chosen device, or the usual one where that is gone.
 * @param {"audio" | "video"} kind @returns {Promise<MediaStreamTrack>}
 */
export async function open(kind) {
  if (!navigator.mediaDevices) throw new Error(text("sound.insecure"));
  const chosen = choices();
  const key = kind === "audio" ? "audioinput" : "videoinput";
  try {
    return await first(kind, chosen);
  } catch (error) {
    const gone = error instanceof DOMException && ["OverconstrainedError", "NotFoundError"].includes(error.name);
    if (!gone || !chosen[key]) throw error;
    return await first(kind, choose({ [key]: "" }));
  }
}

/** @param {"audio" | "video"} kind @param {Choices} chosen */
async function first(kind, chosen) {
  const stream = await navigator.mediaDevices.getUserMedia({ [kind]: constraints(kind, chosen) });
  return stream.getTracks()[0];
}

/**
 * A choice of devices of one kind that shows what there is, now and later.
 * @param {"audioinput" | "audiooutput" | "videoinput"} kind @param {string} label @param {() => void} onChosen
 * @returns {{element: HTMLLabelElement, refresh: () => Promise<void>}}
 */
export function deviceChoice(kind, label, onChosen) {
  const element = document.createElement("label");
  const select = document.createElement("select");
  const words = document.createElement("span");
  words.textContent = label;
  select.id = `choice_${kind}`;
  element.append(words, select);
  const refresh = async () => {
    const devices = navigator.mediaDevices ? await navigator.mediaDevices.enumerateDevices() : [];
    const chosen = choices()[kind];
    const named = devices.filter((device) => device.kind === kind && device.label && device.deviceId !== "default");
    select.replaceChildren(option("", text("sound.usual")), ...named.map((device) => option(device.deviceId, device.label)));
    select.value = named.some((device) => device.deviceId === chosen) ? chosen : "";
  };
  select.addEventListener("change", () => { choose({ [kind]: select.value }); onChosen(); });
  navigator.mediaDevices?.addEventListener("devicechange", refresh);
  refresh();
  return { element, refresh };
}

/** @param {string} value @param {string} words */
function option(value, words) {
  const element = document.createElement("option");
  element.value = value;
  element.textContent = words;
  return element;
}
