// @ts-check
/** Which way pictures and commands take: direct, by a relay, or the slower one without WebRTC; and that there is none. */

import { text } from "./language.js";
import { part } from "./page.js";

const PERIOD = 1000; // ms between two looks

/** @param {import("./page.js").Page} page */
export function start(page) {
  const chip = document.createElement("p");
  chip.id = "way";
  chip.className = "chip";
  part("facts").append(chip);
  let shown = "";
  let lookedAt = -Infinity;
  page.on("tick", async () => {
    if (performance.now() - lookedAt < PERIOD) return;
    lookedAt = performance.now();
    const way = await wayOf(page.link);
    if (way === shown) return;
    if (way === "slower") page.emit("said", text("connection.slower_why"));
    shown = way;
    chip.dataset.way = way;
    chip.textContent = text(`connection.${way}`);
  });
  page.on("left", () => { shown = chip.textContent = ""; });
}

/** @param {import("./link.js").Link} link @returns {Promise<"direct" | "relay" | "slower" | "dialling">} */
export async function wayOf(link) {
  const peer = link.peer;
  if (link.way === "webrtc" && peer) return await isRelayed(peer) ? "relay" : "direct";
  return link.way === "slower" ? "slower" : "dialling";
}

/** @param {RTCPeerConnection} peer */
async function isRelayed(peer) {
  const reports = await peer.getStats();
  /** @type {any[]} */
  const all = [...reports.values()];
  const chosen = all.find((one) => one.type === "transport" && one.selectedCandidatePairId)?.selectedCandidatePairId;
  const pair = reports.get(chosen) ?? all.find((one) => one.type === "candidate-pair" && one.nominated && one.state === "succeeded");
  return [pair?.localCandidateId, pair?.remoteCandidateId].some((id) => reports.get(id)?.candidateType === "relay");
}
