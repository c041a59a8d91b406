// @ts-check
/** Gamepad: hold LB and move. Left stick and cross drive, right stick turns, RB is faster, B is the red stop. As in the
 * window, see telepresence/teleop/joystick_mapping.py. */

import { deflection } from "./held.js";
import { text } from "./language.js";
import { part } from "./page.js";

const B = 1, LB = 4, RB = 5, LT = 6, RT = 7, UP = 12, DOWN = 13, LEFT = 14, RIGHT = 15; // w3.org/TR/gamepad/#remapping
const FAST = 2; // factor of RB
const CREEP = 0.25; // of the speed, by the cross
const STUCK = 2000; // ms: a hand trembles, a pad that has lost its radio does not
const LOOK = 10; // ms between two looks for presses: no browser tells of one, and a quick finger's is over in 30

/** Which buttons are pressed, of whatever pad. No DOM. */
export class PadPresses {
  constructor() {
    /** @type {Map<number, boolean[]>} what is down, by the pad's index */
    this.down = new Map();
  }

  /**
   * @param {{index: number, buttons: readonly {pressed: boolean}[]}[]} pads those that are there
   * @returns {number[]} the buttons that have gone down since the last look. What is down on a pad that has just appeared
   *     counts: a browser hides a pad until one of its buttons is pressed, and a stop too many does no harm.
   */
  look(pads) {
    const before = this.down;
    this.down = new Map(pads.map((pad) => [pad.index, pad.buttons.map((button) => button.pressed)]));
    return [...this.down].flatMap(([index, down]) =>
      [...down.keys()].filter((number) => down[number] && !before.get(index)?.[number]));
  }
}

/** What a pad asks for. No DOM: times are milliseconds, pads have `axes` and `buttons` as in the standard mapping. */
export class PadHand {
  constructor() {
    this.lose();
  }

  /** It must not drive until LB has been let go and is pressed again. */
  lose() {
    this.armed = false;
    this.movedAt = -Infinity;
    this.axes = "";
  }

  /**
   * @param {{axes: readonly number[], buttons: readonly {pressed: boolean}[]}} pad @param {number} now
   * @returns {{parts: number[] | null, boost: number, wants: boolean}} what it holds, and whether LB is held
   */
  read(pad, now) {
    const down = (/** @type {number} */ number) => pad.buttons[number]?.pressed ?? false;
    const pressed = down(LB);
    const looks = down(LT) || down(RT); // then the right stick turns the head
    const axis = (/** @type {number} */ number) => (Number.isFinite(pad.axes[number]) ? deflection(pad.axes[number]) : 0);
    let parts = [-axis(1), -axis(0), looks ? 0 : -axis(2)].map((part) => part || 0);
    const stuck = pad.axes.slice(0, 4).join();
    const moves = parts.some(Boolean);
    if (stuck !== this.axes || !moves) [this.axes, this.movedAt] = [stuck, now];
    const cross = [Number(down(UP)) - Number(down(DOWN)), Number(down(LEFT)) - Number(down(RIGHT))];
    if (!moves && cross.some(Boolean)) parts = [CREEP * cross[0], CREEP * cross[1], 0];
    if (!pressed) this.armed = true;
    else if (now - this.movedAt > STUCK) this.armed = false;
    return { parts: pressed && this.armed ? parts : null, boost: down(RB) ? FAST : 1, wants: pressed };
  }
}

/** @returns {Gamepad[]} */
function connected() {
  return /** @type {Gamepad[]} */ ([...(navigator.getGamepads?.() ?? [])].filter((pad) => pad?.connected));
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  const hand = new PadHand();
  const presses = new PadPresses();
  const chip = document.createElement("p");
  chip.className = "chip";
  chip.id = "padChip";
  chip.hidden = true;
  part("facts").append(chip);
  let index = -1;
  let said = false;
  page.on("letgo", () => hand.lose());
  const gone = () => {
    index = -1;
    hand.lose();
    page.held.release("gamepad");
    page.send();
    page.emit("said", text("gamepad.gone"));
  };
  addEventListener("gamepaddisconnected", (event) => { if (event.gamepad.index === index) gone(); });
  setInterval(() => {
    for (const button of presses.look(connected())) {
      if (button !== B) page.emit("switch"); // B would ask for the framed stop and reset it
      else if (page.me) page.ask("stop");
    }
  }, LOOK);
  page.on("tick", () => {
    const pads = connected();
    const pad = pads.find((each) => each.index === index) ?? pads[0] ?? null;
    page.pad = pad;
    chip.hidden = !pad;
    if (!pad) {
      if (index >= 0) gone(); // a browser may take it off its list before it says so
      return;
    }
    if (pad.index !== index) { index = pad.index; hand.lose(); }
    const { parts, boost, wants } = hand.read(pad, performance.now());
    const reason = wants ? page.refusal() : "";
    if (reason && !said) page.emit("said", reason);
    said = Boolean(reason);
    if (reason) hand.lose();
    if (parts && !reason) { page.held.hold("gamepad", parts); page.held.boost = boost; }
    else { page.held.release("gamepad"); page.held.boost = 1; }
    const words = text(parts && !reason ? "gamepad.drives" : wants && !reason ? "gamepad.again" : "gamepad.ready");
    if (chip.textContent !== words) chip.textContent = words;
  });
}
