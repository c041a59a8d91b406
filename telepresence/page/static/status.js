// @ts-check
/** What goes on, in one sentence; battery, connection, and how old the picture is. */

import { icon } from "./icons.js";
import { show as showWords, text } from "./language.js";
import { section } from "./layout.js";
import { part } from "./page.js";
import { PictureAge } from "./picture_age.js";
import { settings } from "./settings.js";
import { toggle } from "./controls.js";

/** As in the window: gui/widgets/link_health.py. */
const GOOD_DELAY = 0.15; // s
const BAD_DELAY = 0.3;
const LOW = 0.3; // of the charge
const EMPTY = 0.15;
const UNASKED = /^No command (yet|for [\d.]+ s)\.$/; // why the gate lets a robot stand of which nobody wants anything
const HOUR = 3600; // s
const OFTEN = 250; // ms between two changes of a figure: nobody reads faster

/** @param {import("./page.js").Page} page */
export function start(page) {
  const clock = new PictureAge();
  /** @type {number | null} when the picture on the screen was taken */
  let stamp = null;
  /** @type {number | null} of the newest picture when it was shown */
  let age = null;
  page.pictureStamp = () => stamp;
  page.pictureAge = () => age ?? page.state?.picture?.[1] ?? null; // the station's word, where the browser knows no times
  page.link.onPicture = (rtp) => {
    stamp = page.link.slower ? page.link.slower.stamp || null : rtp === undefined ? null : clock.stampOf(rtp);
    age = stamp === null ? null : clock.age(stamp, performance.now() / 1000, least(page));
  };

  const battery = chip("battery");
  const delay = chip("signal");
  const fault = chip("warning");
  part("facts").append(battery.element, delay.element, fault.element);
  fault.element.classList.add("bad");
  let shown = "";
  let changedAt = -Infinity;

  const say = () => {
    const words = sentence(page);
    if (words !== shown) showWords(part("status"), shown = words);
  };
  const show = () => {
    say();
    const now = performance.now();
    if (now - changedAt < OFTEN && page.state) return;
    changedAt = now;
    showBattery(battery, page.state?.battery);
    fault.show(page.state?.fault ?? "");
    const command = page.delay.command(now) / 1000;
    delay.show(page.state && command ? text("picture.command", { ms: Math.round(1000 * command) }) : "", level(command));
    const late = page.link.stale ? (now - page.link.pictureAt) / 1000 + (age ?? 0) : age;
    showAge(page.state ? late : null);
  };
  page.on("state", () => { clock.note(page.state.picture, performance.now() / 1000); show(); });
  page.on("robot", () => { clock.forget(); stamp = age = null; changedAt = -Infinity; show(); });
  page.on("tick", () => {
    part("picture").classList.toggle("stale", page.stale);
    if (page.stale) show();
    else say();
  });
  offerSmallPictures(page);
}

/** The least round trip [s]. @param {import("./page.js").Page} page */
function least(page) {
  return page.delay.least("command", performance.now()) / 1000;
}

/** A fact with an icon; without words it is not there. @param {string} picture */
function chip(picture) {
  const element = document.createElement("p");
  const words = document.createElement("span");
  element.className = "chip";
  element.hidden = true;
  element.append(icon(picture), words);
  return {
    element,
    /** @param {string} value @param {string} [tone] good, warn, bad */
    show(value, tone) {
      element.hidden = !value;
      if (words.textContent !== value) words.textContent = value;
      if (tone !== undefined) for (const name of ["good", "warn", "bad"]) element.classList.toggle(name, name === tone);
    },
  };
}

/** @param {number} delay s @returns {string} */
function level(delay) {
  return delay < GOOD_DELAY ? "good" : delay < BAD_DELAY ? "warn" : "bad";
}

/** @param {number | null} age s */
function showAge(age) {
  const element = part("age");
  const ms = age === null ? 0 : Math.round(1000 * age);
  const words = age === null || age < -1 || age === Infinity ? "" // clocks that disagree, or no picture yet: no figure
    : age > HOUR ? text("picture.age_hour")
    : ms < 1000 ? text("picture.age", { ms: Math.max(0, ms) }) : text("picture.age_seconds", { s: (ms / 1000).toFixed(1) });
  if (element.textContent !== words) element.textContent = words;
  for (const name of ["good", "warn", "bad"]) element.classList.toggle(name, name === level(age ?? 0));
}

/** @param {ReturnType<typeof chip>} shown @param {any} battery */
function showBattery(shown, battery) {
  if (!battery || (battery.share === null && battery.voltage === null)) { shown.show(""); return; }
  const charge = battery.share === null ? `${battery.voltage.toFixed(1)} V` : `${Math.round(100 * battery.share)} %`;
  const empty = battery.low || (battery.share !== null && battery.share < EMPTY);
  shown.show(text(battery.charging ? "picture.charging" : "picture.battery", { charge }),
    empty ? "bad" : battery.share !== null && battery.share < LOW ? "warn" : "good");
}

/** The page's own reasons first: what the station says may be old then. @param {import("./page.js").Page} page */
function sentence(page) {
  const state = page.state;
  if (!state) return page.link.problem || text("driving.connecting");
  const obstacle = page.obstacle();
  if (obstacle) return obstacle;
  if (state.stopped_by) return text("driving.stopped_by", { name: state.stopped_by });
  const reason = state.gate?.reason ?? "";
  // Whoever holds nothing has nothing to learn from it.
  return state.obstacle || (!page.holds && UNASKED.test(reason) ? "" : reason) || text("driving.ready");
}

/** Small pictures save a phone's money. @param {import("./page.js").Page} page */
function offerSmallPictures(page) {
  const wanted = toggle(text("picture.small"), settings.get("smallPicture"), (on) => {
    settings.set("smallPicture", on);
    page.ask("small_picture", on);
  });
  const said = document.createElement("p");
  said.className = "quiet";
  section("picture", text("picture.title")).append(wanted, said);
  let told = false;
  page.on("robot", () => { told = false; });
  page.link.joins.push(() => { told = false; }); // each connection begins with the large ones
  page.on("state", () => {
    if (!told && settings.get("smallPicture") && page.link.way) { told = true; page.ask("small_picture", true); }
    const words = page.link.way === "slower" ? text("picture.slower") : page.state.small ? text("picture.small_now") : "";
    if (said.textContent !== words) said.textContent = words;
  });
}
