// @ts-check
/** When the page dials: how long it waits for an answer, then for a picture. No network, no clock: times are arguments.
 *
 * After a cut the next attempt must be near, so none waits longer than the station needs; yet on a way that has become
 * slower than that an attempt must come through at last, so each one that nobody answers makes the next one longer. */

const FIRST = 4000; // ms for the answer, before there was one
const LEAST = 1000; // ms; likewise
const MOST = 4000;
const LONGER = 1.08; // times, for each attempt that nobody has answered: 1 s becomes 1.7 s in a cut of ten
const AGAIN = 500; // ms from an attempt that failed at once to the next
const PICTURE = 2500; // ms from the answer to the first picture
export const GATHERING = 1000; // ms for the addresses that servers tell (STUN, TURN)
const TRIES = 2; // answers in a row that lead to no connection, after which the slower way is taken
const FIRST_TRIAL = 10000; // ms on the slower way, after which the quick one is tried again; each time twice as long
const LAST_TRIAL = 320000;

export class Dialling {
  constructor() {
    this.until = -Infinity; // for so long the attempt that runs is waited for
    this.began = -Infinity;
    this.took = FIRST / 3; // ms, the last answer
    this.unanswered = 0; // attempts in a row
    this.tries = 0; // answers in a row that have led to nothing
    this.trial = FIRST_TRIAL;
    this.slowerSince = Infinity;
  }

  /** An attempt begins. @param {number} now */
  begin(now) {
    this.unanswered += 1;
    this.ask(now);
  }

  get patience() {
    return Math.min(MOST, Math.max(LEAST, 3 * this.took) * LONGER ** (this.unanswered - 1));
  }

  /** Servers are asked for addresses first. @param {number} now */
  gather(now) {
    this.until = now + GATHERING + MOST;
  }

  /** The station is asked. @param {number} now */
  ask(now) {
    this.began = now;
    this.until = now + this.patience;
  }

  /** The station has answered: it can be reached. @param {number} now */
  answered(now) {
    this.took = now - this.began;
    this.unanswered = 0;
    this.tries += 1;
    this.until = now + PICTURE;
  }

  /** The attempt has failed before its time. */
  failed() {
    this.until = this.began + AGAIN;
  }

  /** Whoever comes back to the page waits for a moment only. @param {number} now @param {number} time ms */
  wait(now, time) {
    this.until = Math.max(this.until, now + time);
  }

  /** The next attempt begins at once. */
  hurry() {
    this.until = -Infinity;
  }

  /** Pictures come: what was learned of a bad way is over. @param {boolean} quickly by WebRTC */
  works(quickly) {
    this.tries = 0;
    if (quickly) this.trial = FIRST_TRIAL;
  }

  /** The slower way is taken. @param {number} now */
  slows(now) {
    this.slowerSince = now;
  }

  /** Whether to try the quick way again, once. It ends the slower one for a moment. @param {number} now */
  tryAgain(now) {
    if (now - this.slowerSince < this.trial) return false;
    this.trial = Math.min(LAST_TRIAL, 2 * this.trial);
    this.tries = TRIES - 1;
    return true;
  }

  get slower() {
    return this.tries >= TRIES;
  }
}
