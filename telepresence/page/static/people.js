// @ts-check
/** Who is in: a tool with their number, and a section with their names, where the robot can be handed to one of them. */

import { showSheet, tool, setTool } from "./layout.js";
import { text } from "./language.js";

/** @typedef {{name: string, role: string, window: string, pilot: boolean, me: boolean}} Person */

/** @param {import("./page.js").Page} page */
export function start(page) {
  const list = document.createElement("ul");
  list.className = "people";
  page.section("people", text("people.title")).append(list);
  const button = tool("people", "people", text("people.title"), () => showSheet(true, "people"));
  const count = document.createElement("span");
  count.className = "count";
  button.append(count);
  /** @type {Person[]} */
  let people = [];
  let shown = "";
  page.on("robot", () => { people = []; show(); });
  page.on("state", () => { people = page.state.people ?? people; show(); });

  /** @type {Map<string, HTMLElement>} by window: rows stay, so that focus and screen readers keep their place */
  const rows = new Map();

  function show() {
    const hands = Boolean(page.state?.mine);
    const now = JSON.stringify([people, hands]);
    if (now === shown) return;
    shown = now;
    count.textContent = people.length > 1 ? String(people.length) : "";
    setTool(button, "people", people.length ? text("people.number", { number: people.length }) : text("people.title"));
    for (const [window, row] of rows)
      if (!people.some((person) => person.window === window)) { row.remove(); rows.delete(window); }
    for (const person of people) {
      const row = rows.get(person.window) ?? makeRow(person);
      fill(row, person, hands);
      if (row.parentNode !== list) list.append(row);
    }
  }

  /** @param {Person} person */
  function makeRow(person) {
    const row = document.createElement("li");
    const give = document.createElement("button");
    give.type = "button";
    give.textContent = text("people.give");
    give.setAttribute("aria-label", text("people.give_to", { name: person.name }));
    give.addEventListener("click", () => page.ask("give", person.window));
    const does = document.createElement("span");
    does.className = "quiet";
    row.append(document.createElement("span"), does, give);
    rows.set(person.window, row);
    return row;
  }

  /** @param {HTMLElement} row @param {Person} person @param {boolean} hands whether this page has the robot */
  function fill(row, person, hands) {
    const [name, does, give] = /** @type {any} */ (row.children);
    name.textContent = person.me ? text("people.me", { name: person.name }) : person.name;
    does.textContent = text(person.pilot ? "people.drives" : person.role === "watcher" ? "people.watches" : "people.may_drive");
    give.hidden = !hands || person.me || person.role === "watcher";
  }
}
