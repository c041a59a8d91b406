// @ts-check
/** Looking around: drag the picture, hold a key or a button, slide a thumb on the right pad, or tilt the right stick with
 * LT. Centre looks straight ahead; looking where I drive turns the head with the robot. See docs/page.md. */

import { isText } from "./driving.js";
import { share } from "./floor.js";
import { Gaze, STEP, TURNS, ahead } from "./gaze.js";
import { deflection } from "./held.js";
import { icon } from "./icons.js";
import { text } from "./language.js";
import { part } from "./page.js";
import { settings } from "./settings.js";
import { stick } from "./touch.js";

/** By place on the keyboard. */
const KEYS = { KeyI: "look_up", KeyK: "look_down", KeyJ: "look_left", KeyL: "look_right" };
const DRAG = 12; // px that a pointer moves before it drags; sooner than floor.js takes it
const OFTEN = 34; // ms between two messages while something moves; half of what the station takes
const TURNED = 0.12; // rad from which on the page shows that the head is turned
const LT = 6, RT = 7; // of the gamepad

/** What stands on the right pad, as the left one drives. */
const BUTTONS = [
  ["way", "along", "G"], ["look_up", "up", "I"], ["centre", "centre", "H"],
  ["look_left", "left", "J"], ["look_down", "down", "K"], ["look_right", "right", "L"],
];

/** @param {import("./page.js").Page} page */
export function start(page) {
  const gaze = new Gaze();
  let sentAt = -Infinity;

  const head = () => /** @type {import("./gaze.js").Head | null} */ (page.state?.head ?? null);
  /** Why the head would not turn; "" if it would. */
  const refusal = () => page.refusal() || head()?.problem || "";
  /** Why it would not turn even when what is only late has come. */
  const objection = () => {
    if (!head()) return text("looking.none");
    for (const reason of page.reasons.values()) if (reason()) return reason();
    return page.state.obstacle || head()?.problem || "";
  };
  const may = () => {
    const words = objection();
    if (words) page.emit("said", words);
    return !words;
  };
  /** Send what is wanted, at once if the last message was long enough ago. */
  const send = () => {
    const now = performance.now();
    const where = head();
    if (!where || refusal() || now - sentAt < OFTEN) return;
    const look = gaze.want(where, now);
    if (!look) return;
    sentAt = now;
    page.link.look(look);
  };
  const act = (/** @type {() => void} */ change) => { if (may()) { change(); send(); } };
  const centre = () => act(() => gaze.centre(performance.now()));
  const follow = () => act(() => gaze.follow(!gaze.way));

  page.on("letgo", () => { gaze.letGo(); sentAt = -Infinity; send(); });
  page.on("robot", () => { gaze.letGo(); gaze.way = false; });
  page.on("tick", () => {
    takePad(page, gaze);
    if (gaze.holds && objection()) gaze.letGo();
    send();
  });

  const buttons = makePad();
  for (const [name, button] of Object.entries(buttons)) {
    if (name === "centre") button.addEventListener("click", centre);
    else if (name === "way") button.addEventListener("click", follow);
    else listenToButton(button, {
      press: () => act(() => gaze.hold(name, TURNS[name])),
      release: () => { gaze.release(name); send(); },
      step: () => act(() => gaze.step(TURNS[name].map((way, axis) => way * STEP[axis]), /** @type {any} */ (head()), performance.now())),
    });
  }
  const thumbEnds = stick(part("lookPad"), {
    begin: () => { gaze.letGo(); may(); },
    move: (right, up) => { if (!refusal()) gaze.hold("thumb", [-right, -up]); },
    end: () => { gaze.release("thumb"); send(); },
  });
  page.on("letgo", thumbEnds);
  listenToPicture(page, gaze, { head, may, send });
  listenToKeys(page, {
    press: (name) => act(() => gaze.hold(name, TURNS[name])),
    release: (name) => { if (gaze.holders.has(name)) { gaze.release(name); send(); } },
    centre, follow,
  });
  showHead(page, gaze, buttons);
  const section = page.section("looking", text("looking.title"));
  const help = document.createElement("p");
  help.textContent = text("looking.help");
  section.append(help);
}

/** @returns {Record<string, HTMLButtonElement>} by name */
function makePad() {
  /** @type {Record<string, HTMLButtonElement>} */
  const made = {};
  for (const [name, picture, key] of BUTTONS) {
    const button = document.createElement("button");
    button.type = "button";
    button.dataset.look = name;
    button.dataset.key = key;
    button.setAttribute("aria-label", text(`looking.${name}`));
    button.title = text(`looking.${name}`);
    button.append(icon(picture));
    part("lookPad").append(button);
    made[name] = button;
  }
  return made;
}

/**
 * A button that turns the head while it is held, and by one step if it is clicked without a pointer.
 * @param {HTMLButtonElement} button @param {{press: () => void, release: () => void, step: () => void}} does
 */
function listenToButton(button, does) {
  button.addEventListener("pointerdown", (event) => {
    if (settings.get("acting") !== "hold") return; // who cannot hold a key turns the head step by step
    button.setPointerCapture(event.pointerId);
    does.press();
  });
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(name, () => does.release());
  button.addEventListener("click", (event) => { if (event.detail === 0 || settings.get("acting") !== "hold") does.step(); });
}

/**
 * @param {import("./page.js").Page} page
 * @param {{press: (name: string) => void, release: (name: string) => void, centre: () => void, follow: () => void}} does
 */
function listenToKeys(page, does) {
  addEventListener("keydown", (event) => {
    if (!page.me || isText(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
    const name = KEYS[event.code];
    if (!name && event.code !== "KeyH" && event.code !== "KeyG") return;
    event.preventDefault();
    if (event.repeat) return;
    if (name) does.press(name);
    else if (event.code === "KeyH") does.centre();
    else does.follow();
  });
  addEventListener("keyup", (event) => { if (KEYS[event.code]) does.release(KEYS[event.code]); });
}

/**
 * Drag the picture: what was under the pointer stays under it. A pointer that stays where it came down is floor.js's.
 * @param {import("./page.js").Page} page @param {Gaze} gaze
 * @param {{head: () => import("./gaze.js").Head | null, may: () => boolean, send: () => void}} does
 */
function listenToPicture(page, gaze, does) {
  const picture = part("picture");
  /** @type {{id: number, x: number, y: number} | null} */
  let down = null;
  const end = () => {
    if (page.pictureHand === "look") page.pictureHand = "";
    gaze.drop();
    down = null;
  };
  const at = (/** @type {PointerEvent} */ event) => {
    const box = picture.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  };
  page.on("letgo", end);
  picture.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
    if (down || event.button !== 0 || !page.me || !does.head()) return;
    if (!share(picture.getBoundingClientRect(), event.clientX, event.clientY)) return;
    picture.setPointerCapture(event.pointerId);
    down = { id: event.pointerId, x: event.clientX, y: event.clientY };
  });
  picture.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
    const head = does.head();
    if (down?.id !== event.pointerId || !head) return;
    if (!gaze.dragged) {
      if (page.pictureHand || Math.hypot(event.clientX - down.x, event.clientY - down.y) <= DRAG) return;
      if (!does.may()) { down = null; return; }
      page.pictureHand = "look";
      const box = picture.getBoundingClientRect();
      gaze.drag((down.x - box.left) / box.width, (down.y - box.top) / box.height, head);
    }
    const [x, y] = at(event);
    gaze.move(x, y, head, performance.now());
    does.send();
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
    picture.addEventListener(name, (/** @type {PointerEvent} */ event) => { if (down?.id === event.pointerId) end(); });
}

/** The right stick with LT or RT; without, it turns the robot. @param {import("./page.js").Page} page @param {Gaze} gaze */
function takePad(page, gaze) {
  const pad = page.pad;
  const looks = pad && (pad.buttons[LT]?.pressed || pad.buttons[RT]?.pressed);
  const parts = looks ? [-deflection(pad.axes[2] ?? 0), deflection(pad.axes[3] ?? 0)] : [0, 0];
  if (parts.some(Boolean) && !page.refusal()) gaze.hold("gamepad", parts);
  else if (gaze.holders.has("gamepad")) gaze.release("gamepad");
}

/**
 * Show that the head is turned, and where ahead is: who drives must not take aside for ahead.
 * @param {import("./page.js").Page} page @param {Gaze} gaze @param {Record<string, HTMLButtonElement>} buttons
 */
function showHead(page, gaze, buttons) {
  const chip = document.createElement("p");
  chip.id = "headChip";
  chip.className = "chip";
  const words = document.createElement("span");
  chip.append(icon("eye"), words);
  chip.hidden = true;
  part("facts").append(chip);
  const mark = document.createElement("div");
  mark.id = "aheadMark";
  mark.append(icon("along"), Object.assign(document.createElement("span"), { textContent: text("looking.ahead") }));
  mark.hidden = true;
  part("over").append(mark);
  const show = () => {
    const head = page.state?.head ?? null;
    part("lookPad").hidden = !head;
    for (const [name, button] of Object.entries(buttons)) button.classList.toggle("held", gaze.holders.has(name));
    buttons.way.setAttribute("aria-pressed", String(gaze.way));
    const turned = Boolean(head) && Math.abs(head.yaw) > TURNED;
    chip.hidden = mark.hidden = !turned;
    if (!turned) return;
    const degrees = Math.round(Math.abs(head.yaw) * 180 / Math.PI);
    const sentence = text(head.yaw > 0 ? "looking.turned_left" : "looking.turned_right", { degrees });
    if (words.textContent !== sentence) words.textContent = sentence;
    const place = ahead(head);
    mark.className = place < 0 ? "left" : place > 1 ? "right" : "";
    mark.style.left = `${100 * Math.max(0, Math.min(1, place))}%`;
  };
  page.on("state", show);
  page.on("robot", show);
}
