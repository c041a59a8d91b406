// @ts-check
/** What is painted over the picture: the way to where somebody holds the floor, and the safety gate's ring, that is how
 * fast the robot may go in each of 72 directions. What they say stands in the status line, too. */

import { part } from "./page.js";

const NAMESPACE = "http://www.w3.org/2000/svg";
const SLOW = 0.9; // of the greatest speed: less is shown as slower
const BLOCKED = 0.02; // m/s
const INNER = 36;
const OUTER = 47;

/** @param {number[]} allowed m/s, counter-clockwise from ahead @param {number} top m/s @returns {string[]} good, warn, bad */
export function tones(allowed, top) {
  return allowed.map((speed) => (speed < BLOCKED ? "bad" : speed < SLOW * top ? "warn" : "good"));
}

/** The `d` of one direction of the ring, ahead is up. @param {number} sector @param {number} sectors */
export function arc(sector, sectors) {
  const half = Math.PI / sectors - 0.008; // a gap between two
  const at = (/** @type {number} */ radius, /** @type {number} */ turn) => {
    const angle = (2 * Math.PI * sector) / sectors + turn;
    return `${(-radius * Math.sin(angle)).toFixed(2)} ${(-radius * Math.cos(angle)).toFixed(2)}`;
  };
  return `M${at(OUTER, -half)}L${at(OUTER, half)}L${at(INNER, half)}L${at(INNER, -half)}Z`;
}

/** @param {string} name @param {Record<string, string>} attributes @returns {any} */
function svg(name, attributes) {
  const element = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  const way = svg("svg", { id: "floorWay", viewBox: "0 0 1 1", preserveAspectRatio: "none", "aria-hidden": "true" });
  const edge = svg("polygon", { class: "edge" });
  const goal = svg("polygon", { class: "goal" });
  way.append(edge, goal);
  const ring = svg("svg", { id: "gateRing", viewBox: "-50 -50 100 100", "aria-hidden": "true" });
  ring.append(svg("circle", { r: "49" }), svg("path", { class: "robot", d: "M0-16 11 12 0 6-11 12Z" }));
  /** @type {any[]} */
  let sectors = [];
  part("over").append(way, ring);

  const show = () => {
    const { way: to, ring: allowed, top } = page.state ?? {};
    way.classList.toggle("shown", Boolean(to));
    if (to) {
      for (const [polygon, corners] of [[edge, to.edge], [goal, to.ring]])
        polygon.setAttribute("points", corners.map((/** @type {number[]} */ corner) => corner.join(",")).join(" "));
      way.dataset.tone = { free: "good", slow: "warn", blocked: "bad" }[to.tone];
    }
    ring.classList.toggle("shown", Boolean(allowed));
    if (!allowed) return;
    if (sectors.length !== allowed.length) {
      for (const sector of sectors) sector.remove();
      sectors = allowed.map((/** @type {number} */ _speed, /** @type {number} */ n) => svg("path", { d: arc(n, allowed.length) }));
      ring.append(...sectors);
    }
    const shown = tones(allowed, top?.[0] ?? Infinity);
    shown.forEach((tone, sector) => { if (sectors[sector].dataset.tone !== tone) sectors[sector].dataset.tone = tone; });
    ring.classList.toggle("free", shown.every((tone) => tone === "good"));
  };
  page.on("state", show);
  page.on("robot", show);
}
