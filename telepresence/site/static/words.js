// @ts-check
/** The few words of these pages; the language is the one that was chosen on a robot's page, or else the browser's. */

const WORDS = {
  en: { title: "Robots", there: "there", away_now: "not there", away: "This robot is not there now.",
    waits: "Its page opens here by itself when it is back.", others: "All robots" },
  de: { title: "Roboter", there: "da", away_now: "nicht da", away: "Dieser Roboter ist gerade nicht da.",
    waits: "Seine Seite öffnet sich hier von selbst, wenn er wieder da ist.", others: "Alle Roboter" },
};

/** What somebody has chosen on a robot's page, see settings.js: en, de, or auto. @returns {string} */
function chosen() {
  try {
    return JSON.parse(localStorage.getItem("pilot") ?? "{}").language ?? "auto";
  } catch {
    return "auto"; // no storage, or nothing that the page has written
  }
}

const wanted = chosen();
const language = (wanted === "auto" ? navigator.language : String(wanted)).startsWith("de") ? "de" : "en";
document.documentElement.lang = language;

/** @param {keyof typeof WORDS.en} name */
export const word = (name) => WORDS[language][name];

/** Put the words where the page has those of its own language. */
export function translate() {
  for (const each of document.querySelectorAll("[data-text]"))
    each.textContent = word(/** @type {any} */ (each).dataset.text);
  document.title = document.querySelector("h1")?.textContent ?? "";
}

/** Whether a robot's page answers. @param {string} path @param {number} patience ms */
export async function answers(path, patience) {
  try {
    return (await fetch(`${path}me`, { signal: AbortSignal.timeout(patience) })).status < 500;
  } catch {
    return false;
  }
}
