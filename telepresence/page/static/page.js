// @ts-check
/** What the parts of the page share: link, hands, the newest state, reasons not to drive. Each part is a module with
 * start(page), which makes its own elements, listens to what it needs, and sends by `page.ask` and `page.held`. */

import { DelayLimit } from "./delay.js";
import { Held } from "./held.js";
import { text } from "./language.js";
import { section } from "./layout.js";
import { Link, STALE } from "./link.js";
import { setOwed } from "./signing_out.js";

const TICK = 50; // ms: 20 commands a second while something is held
const LIFE = 250; // ms between two signs of life
const STALLED = 500; // ms between two ticks after which the page was asleep: what was held then is held no more
const SILENCE = 3000; // ms without a state after which the connection counts as lost, as it does at the station
const ZEROS = 3; // a lost zero would cost 0.3 s of driving

/** @param {string} id @returns {any} */
export const part = (id) => document.getElementById(id);

export class Page extends EventTarget {
  // Events:
  //   "entered"  somebody has signed in: page.me is set          "left"    nobody is signed in any more
  //   "robot"    another robot is looked at: page.robot          "state"   page.state is new, ten times a second
  //   "silent"  the station says nothing any more: page.state is old, see page.silent
  //   "tick"     twenty times a second while signed in           "letgo"   whatever is held must be let go, at once
  //   "said"     {detail: text} the station has refused something or has something to say
  //   "switch"   a button of a gamepad has gone down that is not the stop, whether or not anybody is signed in
  constructor() {
    super();
    this.held = new Held();
    /** @type {any} what the station says of the robot: see docs/page.md */
    this.state = null;
    this.stateAt = -Infinity;
    /** Whether the newest state is so old that the connection counts as lost. */
    this.silent = false;
    /** @type {{name: string, role: string, robots: string[]} | null} */
    this.me = null;
    this.robot = "";
    /** @type {Map<string, () => string>} reasons why nobody should drive by this page now, as functions; "" for none */
    this.reasons = new Map();
    /** @type {Map<string, () => string>} the same for what passes by itself: what is held drives on afterwards */
    this.pauses = new Map();
    this.delay = new DelayLimit();
    /** @type {Gamepad | null} the one in use */
    this.pad = null;
    /** Who has the pointer that is down on the picture: it shows where to drive, or turns the head. @type {"" | "floor" | "look"} */
    this.pictureHand = "";
    /** @type {import("./floor.js").Point | null} where on the floor somebody holds */
    this.floorPoint = null;
    /** Whether a pointer has come down on the picture that may soon point at the floor. */
    this.floorAwaited = false;
    /** When the picture on the screen was taken, by the station's clock [s since 1970]. @type {() => number | null} */
    this.pictureStamp = () => null;
    /** How old the picture on the screen was when it was shown [s], or null. @type {() => number | null} */
    this.pictureAge = () => null;
    this.zeros = 0;
    this.sentAt = -Infinity;
    /** When the newest tick was: by performance.now(), which may miss a sleep, and by the time of day. */
    this.ticked = { at: -Infinity, day: -Infinity };
    this.ticks = 0;
    this.link = new Link(part("picture"), {
      onState: (state) => this.onState(state),
      onSaid: (text) => this.emit("said", text),
      onSignedOut: () => this.leave(),
      onSent: (number) => this.delay.sent(number, performance.now()),
      onEcho: (number) => this.delay.answered(number, performance.now()),
    });
  }

  /** @param {any} state what the station says, but for what is as before */
  onState(state) {
    this.state = { ...seldom(this.state), ...state };
    this.stateAt = performance.now();
    this.silent = false;
    this.emit("state");
  }

  /** @param {string} name @param {any} [detail] */
  emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** @param {string} name @param {(event: CustomEvent) => void} listener */
  on(name, listener) {
    this.addEventListener(name, /** @type {EventListener} */ (listener));
  }

  /** Why nobody should drive by this page now; "" if nothing is wrong. */
  obstacle() {
    return first(this.reasons) || first(this.pauses);
  }

  /** Why nothing would drive that were pressed now; "" if something would. */
  refusal() {
    return this.obstacle() || (this.state ? this.state.obstacle : "");
  }

  /** Whether nobody should drive by the picture on the screen: no new one comes, or the station's own newest is old. */
  get stale() {
    const age = 1000 * (this.state?.picture?.[1] ?? Infinity); // by the station's clock alone
    return this.link.stale || age > STALE;
  }

  /** Whether anything is held. */
  get holds() {
    return Boolean(this.held.velocity() || this.floorPoint);
  }

  /** @param {string} name @param {string} title @returns {HTMLElement} a section of the sheet, to fill */
  section(name, title) {
    return section(name, title);
  }

  /**
   * Ask the station for something; what it refuses is said.
   * @param {string} action a row of REQUESTS in commands.py @param {any} [value] @returns {Promise<boolean>} whether it is done
   */
  async ask(action, value = null) {
    if (action === "stop") this.letGo();
    const problem = await this.link.ask(action, value);
    if (problem) this.emit("said", problem);
    return !problem;
  }

  /** Hold nothing any more, and say so to the robot. */
  letGo() {
    this.held.letGo();
    this.emit("letgo");
    this.send();
  }

  /** Somebody has signed in. @param {{name: string, role: string, robots: string[]}} me */
  enter(me) {
    this.me = me;
    clearInterval(this.ticks);
    this.ticked = { at: performance.now(), day: Date.now() };
    this.ticks = setInterval(() => this.tick(), TICK);
    this.emit("entered");
    this.look(me.robots.includes(this.robot) ? this.robot : me.robots[0]);
  }

  /** Nobody is signed in any more. */
  leave() {
    clearInterval(this.ticks);
    this.held.letGo();
    this.link.hangUp();
    this.link.servers = null; // their passwords are this sign-in's
    this.link.video.srcObject = null; // whoever comes next to this computer sees none of it
    this.me = null;
    this.state = null;
    this.silent = false;
    this.emit("left");
  }

  /** Look at another robot. @param {string} robot */
  look(robot) {
    this.letGo();
    this.robot = this.link.robot = robot;
    this.state = null;
    this.silent = false;
    this.link.redial();
    this.emit("robot");
  }

  tick() {
    this.link.keep();
    this.noteSilence();
    const slept = this.hasSlept();
    const reason = slept ? text("driving.slept") : first(this.reasons) || (this.state ? this.state.obstacle : "");
    const held = this.holds || (slept && this.floorAwaited);
    if (slept || (reason && held)) this.letGo();
    if (reason && held) this.emit("said", reason);
    this.emit("tick");
    this.send();
  }

  noteSilence() {
    if (!this.state || this.silent || performance.now() - this.stateAt <= SILENCE) return;
    this.silent = true;
    this.emit("silent");
  }

  /** Whether the page did not run since the last tick; makes up for what its clock has missed of that. */
  hasSlept() {
    const now = { at: performance.now(), day: Date.now() };
    const passed = now.at - this.ticked.at;
    const uncounted = now.day - this.ticked.day - passed;
    this.ticked = now;
    if (uncounted > STALLED) this.link.uncounted += uncounted; // or the day's clock was set, which does no harm either
    return Math.max(passed, passed + uncounted) > STALLED;
  }

  /** Send what is held, three zeros after it, or a sign of life. */
  send() {
    const now = performance.now();
    const hold = this.obstacle();
    const share = this.delay.share(now);
    const velocity = hold ? null : this.held.velocity();
    if (this.floorPoint) {
      this.link.point(this.floorPoint, this.held.speed * share, hold);
      this.zeros = ZEROS;
      this.sentAt = now;
    } else if (velocity || this.zeros > 0 || now - this.sentAt > LIFE) {
      if (velocity) this.zeros = ZEROS;
      this.link.drive(velocity?.map((part) => part * share) ?? (this.zeros > 0 ? [0, 0, 0] : null), hold);
      if (!velocity && this.zeros > 0) this.zeros -= 1;
      this.sentAt = now;
    }
  }

  /** Sign out: here at once, whatever the network does; entering.js sees to it that the station hears of it. */
  signOut() {
    setOwed(true);
    this.leave();
  }
}

/** What the station leaves out while it is the same: SELDOM in browser_messages.py. @param {any} state */
function seldom(state) {
  return { people: state?.people, ring: state?.ring };
}

/** @param {Map<string, () => string>} reasons @returns {string} the first that holds, or "" */
function first(reasons) {
  for (const reason of reasons.values()) {
    const words = reason();
    if (words) return words;
  }
  return "";
}
