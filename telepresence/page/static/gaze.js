// @ts-check
/** Where the pilot wants to look, by whatever input, as messages of the channel look. No network, no DOM: times are
 * milliseconds, angles radians, yaw to the left, pitch down. */

/** Where the head is, as the station says it. @typedef {{yaw: number, pitch: number, left: number, up: number, down: number, ahead: number, span: [number, number] | null, problem: string}} Head */
/** @typedef {{do: "rate" | "goal" | "ahead" | "way", at: number[] | null}} Look */

/** Unit rates: left, down. */
export const TURNS = { look_left: [1, 0], look_right: [-1, 0], look_up: [0, -1], look_down: [0, 1] };
// As in telepresence/teleop/gaze.py; a test compares them.
const RATE = [1.2, 0.8]; // rad/s while a key is held
const STOPS = 3; // a lost stop would turn the head for 0.3 s more
const NEAR = 0.03; // rad: nearer to a goal it is reached
const PATIENCE = 2500; // ms for which a goal is repeated at most: from one side to the other takes two thirds of it
// The window has none of these.
export const STEP = [0.26, 0.17]; // rad by which one press turns the head where nobody can hold
const SPAN = [0.98, 0.76]; // rad that a picture shows where its camera is not calibrated

export class Gaze {
  constructor() {
    /** @type {Map<string, number[]>} what turns the head -> parts of its rates, -1 to 1: left, down */
    this.holders = new Map();
    /** Whether the head looks where the robot drives while nothing else turns it. */
    this.way = false;
    /** @type {{x: number, y: number, from: [number, number]} | null} where a drag began, in shares of the picture */
    this.dragged = null;
    /** @type {{look: Look, until: number} | null} */
    this.aim = null;
    this.stops = 0;
  }

  /** Whether somebody turns the head at this moment. */
  get holds() {
    return this.holders.size > 0 || this.dragged !== null;
  }

  /** @param {string} holder a key, a button, a stick @param {number[]} parts -1 to 1: left, down */
  hold(holder, parts) {
    this.holders.set(holder, parts);
    this.aim = this.dragged = null;
    this.way = false;
  }

  /** @param {string} holder */
  release(holder) {
    if (this.holders.delete(holder) && this.holders.size === 0) this.stops = STOPS;
  }

  /** Begin to drag the picture. @param {number} x @param {number} y shares of it @param {Head} head */
  drag(x, y, head) {
    this.holders.clear();
    this.way = false;
    this.dragged = { x, y, from: [head.yaw, head.pitch] };
  }

  /** What was under the pointer stays under it. @param {number} x @param {number} y @param {Head} head @param {number} now */
  move(x, y, head, now) {
    if (!this.dragged) return;
    const { from } = this.dragged;
    const [across, down] = head.span ?? SPAN;
    const wanted = [
      from[0] + bearing(x, across) - bearing(this.dragged.x, across),
      from[1] - bearing(y, down) + bearing(this.dragged.y, down),
    ];
    const goal = reachable(wanted, head);
    // At a limit the way back begins at once.
    from[0] += goal[0] - wanted[0];
    from[1] += goal[1] - wanted[1];
    this.goTo(goal, now);
  }

  /** The drag is over; what it asked for is still reached. */
  drop() {
    this.dragged = null;
  }

  /** Turn on by so much. @param {number[]} change rad @param {Head} head @param {number} now */
  step(change, head, now) {
    const from = this.aim?.look.do === "goal" ? /** @type {number[]} */ (this.aim.look.at) : [head.yaw, head.pitch];
    this.way = false;
    this.goTo(reachable([from[0] + change[0], from[1] + change[1]], head), now);
  }

  /** Look straight ahead. @param {number} now */
  centre(now) {
    this.holders.clear();
    this.dragged = null;
    this.way = false;
    this.aim = { look: { do: "ahead", at: null }, until: now + PATIENCE };
  }

  /** @param {boolean} wanted whether to look where the robot drives */
  follow(wanted) {
    this.holders.clear();
    this.aim = this.dragged = null;
    this.way = wanted;
    if (!wanted) this.stops = STOPS;
  }

  /** Turn no more, at once. */
  letGo() {
    if (this.holds || this.aim) this.stops = STOPS;
    this.holders.clear();
    this.aim = this.dragged = null;
  }

  /** What to send now; null for nothing. @param {Head} head @param {number} now @returns {Look | null} */
  want(head, now) {
    if (this.holders.size > 0) {
      const sum = [0, 0];
      for (const parts of this.holders.values()) parts.forEach((part, axis) => { sum[axis] += part; });
      return { do: "rate", at: sum.map((part, axis) => Math.max(-1, Math.min(1, part)) * RATE[axis]) };
    }
    if (this.aim && !this.dragged && (now > this.aim.until || reached(this.aim.look, head))) this.aim = null;
    if (this.aim) return this.aim.look;
    if (this.stops > 0) {
      this.stops -= 1;
      return { do: "rate", at: [0, 0] };
    }
    return this.way ? { do: "way", at: null } : null;
  }

  /** @param {number[]} goal @param {number} now */
  goTo(goal, now) {
    this.aim = { look: { do: "goal", at: goal }, until: now + PATIENCE };
  }
}

/** @param {number[]} angles @param {Head} head @returns {[number, number]} the nearest ones that it can have, about */
export function reachable(angles, head) {
  const within = (/** @type {number} */ value, /** @type {number} */ least, /** @type {number} */ most) =>
    Math.max(least, Math.min(most, value));
  return [within(angles[0], -head.left, head.left), within(angles[1], head.up, head.down)];
}

/** @param {Look} look @param {Head} head */
function reached(look, head) {
  const goal = look.do === "ahead" ? [0, head.ahead] : look.at;
  return goal !== null && Math.hypot(goal[0] - head.yaw, goal[1] - head.pitch) < NEAR;
}

/** @param {number} share of the picture @param {number} span rad that it shows @returns {number} rad from its middle */
function bearing(share, span) {
  return Math.atan((2 * share - 1) * Math.tan(span / 2));
}

/**
 * Where in the picture the place straight ahead of the robot is.
 * @param {Head} head @returns {number} share from its left; below 0 and above 1 beside it
 */
export function ahead(head) {
  const across = (head.span ?? SPAN)[0];
  const yaw = Math.max(-1.4, Math.min(1.4, head.yaw));
  return 0.5 + Math.tan(yaw) / (2 * Math.tan(across / 2));
}
