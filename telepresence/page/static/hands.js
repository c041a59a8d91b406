// @ts-check
/** What is held now, by keys or fingers, as a velocity. No network, no picture. */

const DIRECTIONS = {
  forward: [1, 0, 0], back: [-1, 0, 0], left: [0, 1, 0], right: [0, -1, 0],
  "turn-left": [0, 0, 1], "turn-right": [0, 0, -1],
};
/** By place on the keyboard, whatever letter is printed there. */
const KEYS = {
  KeyW: "forward", KeyS: "back", KeyA: "turn-left", KeyD: "turn-right", KeyQ: "left", KeyE: "right",
  ArrowUp: "forward", ArrowDown: "back", ArrowLeft: "turn-left", ArrowRight: "turn-right",
};

export class Hands {
  /** @param {number} speed m/s @param {number} turn rad/s */
  constructor(speed = 0.2, turn = 0.5) {
    this.speed = speed;
    this.turn = turn;
    /** @type {Map<string, string>} what holds -> which direction */
    this.held = new Map();
  }

  /** @param {string} code @returns whether the key drives */
  press(code) {
    const direction = KEYS[code];
    if (direction) this.held.set(code, direction);
    return Boolean(direction);
  }

  /** @param {string} holder @param {string} direction */
  hold(holder, direction) {
    this.held.set(holder, direction);
  }

  /** @param {string} holder */
  release(holder) {
    this.held.delete(holder);
  }

  letGo() {
    this.held.clear();
  }

  /** @returns {number[] | null} forward, left [m/s], counter-clockwise [rad/s]; null while nothing is held */
  velocity() {
    if (this.held.size === 0) return null;
    const sum = [0, 0, 0];
    for (const direction of new Set(this.held.values()))
      DIRECTIONS[direction].forEach((part, axis) => { sum[axis] += part; });
    const length = Math.max(1, Math.hypot(sum[0], sum[1]));
    return [sum[0] / length * this.speed, sum[1] / length * this.speed, sum[2] * this.turn];
  }
}
