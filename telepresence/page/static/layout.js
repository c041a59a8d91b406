// @ts-check
/** Where the parts of the page put what they make: round buttons in the tools, sections in the sheet. */

import { icon } from "./icons.js";
import { text } from "./language.js";

/** The order in which tools and sections stand, whoever comes first; what is not named here comes before the last one. */
const TOOLS = ["robots", "speaker", "microphone", "camera", "say", "people", "full", "menu"];
const SECTIONS = ["robots", "people", "links", "driving", "looking", "sound", "picture", "connection", "settings", "access"];

/** Here the picture makes way for the sheet; elsewhere the sheet covers everything but the red stop. As in page.css. */
const ROOMY = "(min-aspect-ratio: 11/10) and (min-width: 1000px)";

/** @param {string} id @returns {any} */
const part = (id) => document.getElementById(id);

/** @param {HTMLElement} slot @param {HTMLElement} element @param {string} name @param {string[]} order */
function insert(slot, element, name, order) {
  const place = order.includes(name) ? order.indexOf(name) : order.length - 1.5;
  element.dataset.place = String(place);
  const next = [...slot.children].find((other) => Number(/** @type {HTMLElement} */ (other).dataset.place) > place);
  slot.insertBefore(element, next ?? null);
}

/**
 * A round button in #tools.
 * @param {string} name @param {string} picture name of an icon @param {string} label what it does, in words
 * @param {() => void} onClick @returns {HTMLButtonElement}
 */
export function tool(name, picture, label, onClick) {
  const button = document.createElement("button");
  button.type = "button";
  button.id = `tool_${name}`;
  button.addEventListener("click", onClick);
  setTool(button, picture, label);
  insert(part("tools"), button, name, TOOLS);
  return button;
}

/** Give a tool another icon and another name. @param {HTMLButtonElement} button @param {string} picture @param {string} label */
export function setTool(button, picture, label) {
  if (button.dataset.icon !== picture) button.replaceChildren(icon(picture));
  button.dataset.icon = picture;
  button.setAttribute("aria-label", label);
  button.title = label;
}

/**
 * The section of that name in the sheet, made if it is not there yet.
 * @param {string} name @param {string} title @returns {HTMLElement} to fill
 */
export function section(name, title) {
  const found = part(`section_${name}`);
  if (found) return found;
  const details = document.createElement("details");
  const summary = document.createElement("summary");
  const body = document.createElement("div");
  summary.textContent = title;
  body.id = `section_${name}`;
  body.className = "body";
  details.append(summary, body);
  insert(part("sections"), details, name, SECTIONS);
  return body;
}

/** Open the sheet, or close it. @param {boolean} open @param {string} [name] of a section to open in it */
export function showSheet(open, name) {
  part("sheet").hidden = !open;
  part("drive").classList.toggle("withSheet", open);
  part("tool_menu").setAttribute("aria-expanded", String(open));
  shutCovered();
  const body = name && part(`section_${name}`);
  if (body) body.parentElement.open = true;
  if (!open) part("tool_menu").focus();
  else if (body) body.previousElementSibling.focus();
  else part("sheet").focus();
}

/** Nothing that the sheet covers can get the focus. */
function shutCovered() {
  const covered = !part("sheet").hidden && !matchMedia(ROOMY).matches;
  for (const id of ["stage", "top", "actions", "pads", "tools"]) part(id).inert = covered;
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  const menu = tool("menu", "menu", text("page.menu"), () => showSheet(part("sheet").hidden));
  menu.setAttribute("aria-controls", "sheet");
  menu.setAttribute("aria-expanded", "false");
  part("sheetClose").addEventListener("click", () => showSheet(false));
  matchMedia(ROOMY).addEventListener("change", shutCovered);
  page.on("left", () => { if (!part("sheet").hidden) showSheet(false); });
  const picture = part("picture");
  picture.addEventListener("resize", () => {
    // The slot over the picture is exactly as large as the picture: shares of it are shares of the picture.
    if (picture.videoWidth) document.documentElement.style.setProperty("--ratio", String(picture.videoWidth / picture.videoHeight));
  });
}
