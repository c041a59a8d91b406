// @ts-check
/** Inviting: make a link, show it as a QR code, send it, and withdraw it. For pilots with an account. */

import { show, text } from "./language.js";
import { get, post } from "./link.js";

const HOURS = [0.5, 2, 24];
const ROLES = ["watcher", "pilot"];

/** @typedef {{id: string, role: string, once: boolean, left: number, maker: string, used: number}} Invitation */

/** @param {import("./page.js").Page} page */
export function start(page) {
  const body = page.section("links", text("links.title"));
  const section = /** @type {HTMLDetailsElement} */ (body.parentElement);
  const role = choice("role", ROLES.map((one) => [one, text(`links.${one}`)]));
  const hours = choice("hours", HOURS.map((one) => [String(one), duration(one * 3600)]));
  const once = document.createElement("input");
  once.type = "checkbox";
  const onceRow = label(text("links.once"), once);
  onceRow.className = "row";
  const make = button(text("links.make"), makeLink);
  make.className = "primary";
  const problem = document.createElement("p");
  problem.className = "problem";
  problem.setAttribute("role", "alert");
  const made = document.createElement("div");
  made.className = "made";
  const list = document.createElement("ul");
  list.className = "people";
  body.append(label(text("links.may"), role), label(text("links.for"), hours), onceRow, make, problem, made, list);
  role.value = "watcher";
  hours.value = "2";

  page.on("entered", () => { section.hidden = !page.me?.invites; forget(); });
  page.on("left", forget);
  section.addEventListener("toggle", () => { if (section.open) showList(); });

  /** Nobody who comes in next on this device shall see the links of whoever was in before. */
  function forget() {
    section.open = false;
    made.replaceChildren();
    list.replaceChildren();
    problem.textContent = "";
  }

  async function makeLink() {
    problem.textContent = "";
    try {
      const invitation = await post("invite", { role: role.value, hours: Number(hours.value), once: once.checked });
      showMade(invitation);
      await showList();
    } catch (error) {
      show(problem, error.message);
    }
  }

  /** @param {Invitation & {link: string, qr: string[]}} invitation */
  function showMade({ link, qr, role, left }) {
    const field = document.createElement("input");
    field.readOnly = true;
    field.value = link;
    field.setAttribute("aria-label", text("links.link"));
    field.addEventListener("focus", () => field.select());
    const copy = button(text("links.copy"), async () => {
      field.select();
      try {
        await navigator.clipboard.writeText(link);
        copy.textContent = text("links.copied");
      } catch { // not allowed: it is selected, to be copied by hand
        field.focus();
      }
    });
    const buttons = document.createElement("div");
    buttons.className = "buttons";
    buttons.append(copy);
    if (navigator.share) buttons.append(button(text("links.share"), () => navigator.share({ url: link }).catch(() => {})));
    const words = document.createElement("p");
    words.textContent = text(`links.made_${role}`, { time: duration(left) });
    made.replaceChildren(drawn(qr), words, field, buttons);
    copy.focus();
  }

  async function showList() {
    try {
      const { invitations } = await get("invitations");
      list.replaceChildren(...invitations.map(row));
    } catch (error) {
      show(problem, error.message);
    }
  }

  /** @param {Invitation} invitation */
  function row(invitation) {
    const item = document.createElement("li");
    const what = document.createElement("span");
    what.textContent = text(`links.row_${invitation.role}`, { time: duration(invitation.left), maker: invitation.maker });
    const used = document.createElement("span");
    used.className = "quiet";
    used.textContent = text("links.used", { number: invitation.used });
    item.append(what, used, button(text("links.withdraw"), async () => {
      try {
        await post("withdraw", { id: invitation.id });
      } catch (error) {
        show(problem, error.message);
      }
      made.replaceChildren();
      await showList();
      make.focus();
    }));
    return item;
  }
}

/** @param {string[]} rows of a QR code @returns {HTMLCanvasElement} */
function drawn(rows) {
  const canvas = document.createElement("canvas");
  canvas.className = "qr";
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", text("links.qr"));
  canvas.width = canvas.height = rows.length;
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.fillStyle = "#fff";
  context.fillRect(0, 0, rows.length, rows.length);
  context.fillStyle = "#000";
  rows.forEach((row, y) => [...row].forEach((dark, x) => { if (dark === "1") context.fillRect(x, y, 1, 1); }));
  return canvas;
}

/** @param {number} seconds */
export function duration(seconds) {
  const minutes = Math.max(1, Math.round(seconds / 60));
  if (minutes < 90) return text("links.minutes", { number: minutes });
  const hours = Math.round(minutes / 60);
  return hours < 48 ? text("links.hours", { number: hours }) : text("links.days", { number: Math.round(hours / 24) });
}

/** @param {string} name @param {string[][]} options value and words each */
function choice(name, options) {
  const select = document.createElement("select");
  select.name = name;
  select.append(...options.map(([value, words]) => new Option(words, value)));
  return select;
}

/** @param {string} words @param {HTMLElement} control */
function label(words, control) {
  const made = document.createElement("label");
  const span = document.createElement("span");
  span.textContent = words;
  if (control instanceof HTMLInputElement && control.type === "checkbox") made.append(control, span);
  else made.append(span, control);
  return made;
}

/** @param {string} words @param {() => void} onClick */
function button(words, onClick) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = words;
  made.addEventListener("click", onClick);
  return made;
}
