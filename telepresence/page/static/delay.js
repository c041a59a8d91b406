// @ts-check
/** How fast a slow connection lets people drive, and how long the next picture may take. No DOM, no network; times are
 * milliseconds of one clock. As in the window: gui/driving/delay_speed_limit.py and picture_patience.py say why. */

const HALF_FROM = 500;
const STOP_FROM = 1000;
const WINDOW = 500; // the least delay in this time counts: one late message is no slow connection
const FORGET_AFTER = 2000; // a delay says something about now for that long
const MOST_UNANSWERED = 64;

/** The share of the speed that may be asked for. */
export class DelayLimit {
  constructor() {
    /** @type {Record<string, {at: number, delay: number}[]>} */
    this.noted = { command: [], picture: [] };
    /** @type {Map<number, number>} number of a message -> when it was sent */
    this.sentAt = new Map();
    this.unproven = false;
  }

  /** A message that will be answered was sent. @param {number} number @param {number} now */
  sent(number, now) {
    this.sentAt.set(number, now);
    if (this.sentAt.size > MOST_UNANSWERED) this.sentAt.delete(this.sentAt.keys().next().value ?? 0);
  }

  /** @param {number} number of the message that was answered @param {number} now */
  answered(number, now) {
    const sent = this.sentAt.get(number);
    if (sent === undefined) return;
    for (const [earlier] of this.sentAt) if (earlier <= number) this.sentAt.delete(earlier); // never sent twice: those are lost
    this.note("command", now - sent, now);
  }

  /** The connection is another one: nothing that was sent will be answered. */
  forget() {
    this.sentAt.clear();
  }

  /** @param {"command" | "picture"} kind @param {number} delay @param {number} now */
  note(kind, delay, now) {
    const noted = this.noted[kind];
    noted.push({ at: now, delay });
    while (noted.length > 2 && now - noted[0].at > WINDOW) noted.shift();
  }

  /** @param {"command" | "picture"} kind @param {number} now @returns {number} 0 when it is unknown */
  least(kind, now) {
    const fresh = this.noted[kind].filter(({ at }) => now - at <= FORGET_AFTER).map(({ delay }) => delay);
    return fresh.length ? Math.min(...fresh) : 0;
  }

  /** For how long the oldest unanswered message has waited. @param {number} now */
  waiting(now) {
    const oldest = this.sentAt.values().next().value;
    return oldest === undefined ? 0 : now - oldest;
  }

  /** The delay of commands [ms]. @param {number} now */
  command(now) {
    const waiting = this.waiting(now);
    return Math.max(this.least("command", now), waiting > HALF_FROM ? waiting : 0);
  }

  /** 1, 0.5 or 0; after a connection that was too slow half until a message is answered in time. @param {number} now */
  share(now) {
    const command = this.command(now);
    const delay = Math.max(command, this.least("picture", now));
    if (command > STOP_FROM) this.unproven = true;
    else if (command > 0 && command <= HALF_FROM) this.unproven = false;
    if (delay > STOP_FROM) return 0;
    return delay > HALF_FROM || this.unproven ? 0.5 : 1;
  }
}

const LEAST_PATIENCE = 300;
const MOST_PATIENCE = 1000;
const PERIODS = 2.5; // usual periods between two pictures that the next one may take
const REMEMBERED = 9;
const FEWEST = 3; // periods from which on the usual one is known

/** How long the next picture may take before the robot stops. */
export class Patience {
  constructor() {
    /** @type {number[]} */
    this.periods = [];
    this.arrived = -Infinity;
  }

  /** A picture was shown. @param {number} at */
  note(at) {
    if (at <= this.arrived) return;
    if (at - this.arrived < MOST_PATIENCE * 2) this.periods = [...this.periods, at - this.arrived].slice(-REMEMBERED);
    this.arrived = at;
  }

  forget() {
    this.periods = [];
    this.arrived = -Infinity;
  }

  /** @returns {number} for how long the newest picture is good enough to drive by */
  get milliseconds() {
    if (this.periods.length < FEWEST) return MOST_PATIENCE;
    const usual = [...this.periods].sort((a, b) => a - b)[Math.floor(this.periods.length / 2)];
    return Math.min(MOST_PATIENCE, Math.max(LEAST_PATIENCE, PERIODS * usual));
  }

  /** @param {number} now */
  late(now) {
    return now - this.arrived > this.milliseconds;
  }
}
