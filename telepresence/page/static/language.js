// @ts-check
/** The page's texts, all in one file per language: text_en.json, {"part": {"what": "Sentence with {name}."}}. What the
 * station says comes in English; the part "station" has those sentences and what stands in their place. */

/** Each in its own words. @type {Record<string, string>} */
export const LANGUAGES = { en: "English", de: "Deutsch" };

/** @type {Record<string, Record<string, string>>} */
let texts = {};
/** @type {[RegExp, string[], string][]} what the station says, what changes in it, and in which words the page says it */
let patterns = [];

/**
 * Load the texts, and fill in what stands in the page itself.
 * @param {string} [chosen] a language; else the first of the browser's that there is
 */
export async function loadLanguage(chosen = "auto") {
  const wanted = [chosen, ...navigator.languages.map((name) => name.slice(0, 2))].find((name) => name in LANGUAGES) ?? "en";
  document.documentElement.lang = wanted;
  texts = await (await fetch(`static/text_${wanted}.json`)).json();
  patterns = Object.entries(texts.station ?? {}).map(([sentence, words]) => {
    const names = [...sentence.matchAll(/\{(\w+)\}/g)].map((match) => match[1]);
    const literal = sentence.replace(/[.*+?^$()|[\]\\]/g, "\\$&").replace(/\{\w+\}/g, "((?:(?!\\. ).)+?)"); // no further sentence
    return [new RegExp(`^${literal}$`), names, words];
  });
  for (const element of document.querySelectorAll("[data-text]"))
    element.textContent = text(/** @type {HTMLElement} */ (element).dataset.text ?? "");
  for (const element of document.querySelectorAll("[data-label]"))
    element.setAttribute("aria-label", text(/** @type {HTMLElement} */ (element).dataset.label ?? ""));
}

/**
 * @param {string} name of a sentence: "driving.forward"
 * @param {Record<string, string | number>} [values] for what stands in braces
 */
export function text(name, values = {}) {
  const [part, what] = name.split(".");
  const sentence = texts[part]?.[what];
  if (sentence === undefined) throw new Error(`there is no text ${name}`);
  return sentence.replace(/\{(\w+)\}/g, (_all, key) => String(values[key]));
}

/**
 * What the station says, in the page's language; "" if that is not known.
 * @param {string} said one sentence or several @returns {string}
 */
export function told(said) {
  for (const [pattern, names, words] of patterns) {
    const found = pattern.exec(said);
    if (found) return words.replace(/\{(\w+)\}/g, (_all, name) => list(found[1 + names.indexOf(name)]));
  }
  const sentences = said.split(/(?<=\.) /);
  const each = sentences.length > 1 ? sentences.map(told) : [];
  return each.length && each.every(Boolean) ? each.join(" ") : "";
}

/** Directions and the like are sentences of their own. @param {string} value */
function list(value) {
  return value.split(", ").map((each) => told(each) || each).join(", ");
}

/** Show what the station or the page says; English stays English for a screen reader, too. @param {HTMLElement} element @param {string} said */
export function show(element, said) {
  const words = told(said);
  element.textContent = words || said;
  element.lang = words || Object.values(texts).some((part) => Object.values(part).includes(said)) ? "" : "en";
  if (!element.lang) element.removeAttribute("lang");
}
