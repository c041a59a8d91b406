// @ts-check
/** What somebody has set for this browser: kept in it alone, and shown in the sheet's section Settings. */

import { choice, toggle } from "./controls.js";
import { LANGUAGES, text } from "./language.js";
import { setTool, tool } from "./layout.js";

const STORE = "pilot";
/** @type {Record<string, any>} */
const DEFAULTS = {
  theme: "auto", // "auto", "dark", "light"
  language: "auto",
  letters: true, // letters of the keyboard do something
  large: false, // large keys
  smallPicture: false, // fewer and smaller pictures
  acting: "hold", // how a press drives: acting.js
  step: 0.2, // m
  scanning: false, // one switch: scanning.js
  scanTime: 1, // s
  dwelling: false, // resting presses: dwelling.js
  dwellTime: 0.8, // s
};

class Settings extends EventTarget {
  constructor() {
    super();
    /** @type {Record<string, any>} */
    this.values = { ...DEFAULTS, ...stored() };
  }

  /** @param {string} name */
  get(name) {
    return this.values[name];
  }

  /** Set and keep; the event "change" follows. @param {string} name @param {any} value */
  set(name, value) {
    this.values[name] = value;
    try {
      localStorage.setItem(STORE, JSON.stringify(this.values));
    } catch (error) {
      console.warn("this browser keeps no settings", error);
    }
    this.dispatchEvent(new CustomEvent("change", { detail: name }));
  }
}

/** @returns {Record<string, any>} of the kinds that DEFAULTS has: anything could stand there */
function stored() {
  try {
    const values = JSON.parse(localStorage.getItem(STORE) ?? "{}");
    return Object.fromEntries(Object.entries(values).filter(([name, value]) => typeof value === typeof DEFAULTS[name]));
  } catch (error) {
    console.warn("what this browser kept of the settings cannot be read", error);
    return {};
  }
}

export const settings = new Settings();

/** @param {import("./page.js").Page} page */
export function start(page) {
  const body = page.section("settings", text("settings.title"));
  body.append(
    choice(text("settings.theme"), ["auto", "dark", "light"].map((name) => [name, text(`settings.theme_${name}`)]),
      settings.get("theme"), (value) => settings.set("theme", value)),
    choice(text("settings.language"), [["auto", text("settings.language_auto")], ...Object.entries(LANGUAGES)],
      settings.get("language"), (value) => { settings.set("language", value); location.reload(); }),
    toggle(text("settings.large"), settings.get("large"), (on) => settings.set("large", on)),
    toggle(text("settings.letters"), settings.get("letters"), (on) => settings.set("letters", on)),
  );
  paint();
  settings.addEventListener("change", paint);
  matchMedia("(prefers-color-scheme: light)").addEventListener("change", paint);
  // Before all others: what is switched off here reaches nobody.
  addEventListener("keydown", (event) => {
    if (!settings.get("letters") && event.key.length === 1 && event.key !== " " && !writes(event.target))
      event.stopImmediatePropagation();
  }, true);
  startFullScreen();
}

function paint() {
  const light = matchMedia("(prefers-color-scheme: light)").matches;
  const theme = settings.get("theme");
  document.documentElement.dataset.theme = theme === "auto" ? (light ? "light" : "dark") : theme;
  document.documentElement.classList.toggle("large", settings.get("large") || settings.get("dwelling"));
}

/** Whether somebody writes there. @param {EventTarget | null} target */
export function writes(target) {
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement ||
    (target instanceof HTMLInputElement && !["checkbox", "radio", "range"].includes(target.type));
}

function startFullScreen() {
  if (!document.fullscreenEnabled) return; // an iPhone shows films alone so
  const flip = () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen());
  const button = tool("full", "full", text("settings.full"), flip);
  document.addEventListener("fullscreenchange", () => {
    const full = Boolean(document.fullscreenElement);
    setTool(button, full ? "small" : "full", text(full ? "settings.not_full" : "settings.full"));
  });
  addEventListener("keydown", (event) => {
    if (event.code === "KeyF" && !event.repeat && !event.ctrlKey && !event.metaKey && !event.altKey && !writes(event.target)) flip();
  });
}
