// @ts-check
/** What is held now, by whatever input, as a velocity. No network, no picture, no DOM. */

/** Unit velocities: forward, left, counter-clockwise. */
export const DIRECTIONS = {
  forward: [1, 0, 0], back: [-1, 0, 0], left: [0, 1, 0], right: [0, -1, 0],
  turn_left: [0, 0, 1], turn_right: [0, 0, -1],
};
// As in telepresence/teleop: hand_speeds.py and joystick_mapping.py; a test compares them.
const USUAL_SPEED = 0.2; // m/s
export const SPEED_STEP = 0.05; // m/s between two speeds
const TURN_PER_SPEED = 2.5; // rad/s per m/s: 0.5 rad/s at 0.2 m/s
const DEAD_ZONE = 0.12; // of a stick
const CURVE = 1.7; // exponent: small deflections drive slower

export class Held {
  /** @param {number} speed m/s @param {number} topSpeed m/s @param {number} topTurn rad/s */
  constructor(speed = USUAL_SPEED, topSpeed = 0.35, topTurn = 1) {
    this.topSpeed = topSpeed;
    this.topTurn = topTurn;
    this.speed = speed;
    this.boost = 1; // while the pad's fast button is held
    /** @type {Map<string, number[]>} what holds -> parts of the greatest speeds, -1 to 1: forward, left, counter-clockwise */
    this.holders = new Map();
  }

  /** What the robot's safety gate ever allows. @param {number} speed m/s @param {number} turn rad/s */
  setTop(speed, turn) {
    this.topSpeed = speed;
    this.topTurn = turn;
    this.setSpeed(this.speed);
  }

  /** @param {number} speed m/s, from now on, as near as the robot allows */
  setSpeed(speed) {
    const steps = Math.max(1, Math.min(Math.floor(this.topSpeed / SPEED_STEP + 1e-6), Math.round(speed / SPEED_STEP)));
    this.speed = Math.round(steps * SPEED_STEP * 100) / 100;
  }

  /** @returns {number} rad/s */
  get turn() {
    return Math.min(this.topTurn, this.speed * TURN_PER_SPEED);
  }

  /** @param {string} holder a key, a button, a stick @param {number[]} parts -1 to 1 */
  hold(holder, parts) {
    this.holders.set(holder, parts);
  }

  /** @param {string} holder */
  release(holder) {
    this.holders.delete(holder);
  }

  letGo() {
    this.holders.clear();
    this.boost = 1;
  }

  /** @returns {number[] | null} forward, left [m/s], counter-clockwise [rad/s]; null while nothing is held */
  velocity() {
    if (this.holders.size === 0) return null;
    const sum = [0, 0, 0];
    for (const parts of this.holders.values()) parts.forEach((part, axis) => { sum[axis] += part; });
    const bounded = sum.map((part) => Math.max(-1, Math.min(1, part)));
    const length = Math.max(1, Math.hypot(bounded[0], bounded[1]));
    const speed = Math.min(this.topSpeed, this.speed * this.boost) / length;
    return [bounded[0] * speed, bounded[1] * speed, bounded[2] * Math.min(this.topTurn, this.turn * this.boost)];
  }
}

/** How far a stick is out, as speed: nothing near its middle, and slowly at first. @param {number} value -1 to 1 @param {number} deadZone */
export function deflection(value, deadZone = DEAD_ZONE) {
  const size = (Math.min(1, Math.abs(value)) - deadZone) / (1 - deadZone);
  return size > 0 ? Math.sign(value) * size ** CURVE : 0;
}
