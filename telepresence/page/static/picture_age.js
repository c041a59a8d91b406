// @ts-check
/** When each picture on the screen was taken, and how old it is. No DOM, no network; seconds.
 *
 * The station says of one picture what RTP calls it and when it was taken: RTP's clock runs at 90 kHz for all of them. The
 * difference of the two machines' clocks is that of the message that took least, less half of the least round trip. */

const RTP_RATE = 90000;
const REMEMBERED = 100; // messages, ten a second

export class PictureAge {
  constructor() {
    this.forget();
  }

  /** Another robot, another connection. */
  forget() {
    /** @type {[number, number] | null} what RTP calls a picture, and when it was taken */
    this.known = null;
    /** @type {number[]} what the messages took, and the difference of the clocks */
    this.took = [];
  }

  /** A state has come. @param {[number, number, number] | null} picture RTP's time or -1, age, stamp @param {number} now ours */
  note(picture, now) {
    if (!picture) return;
    const [rtp, age, stamp] = picture;
    this.known = rtp < 0 ? null : [rtp, stamp];
    this.took = [...this.took, now - (stamp + age)].slice(-REMEMBERED);
  }

  /** When a picture was taken, by the station's clock. @param {number} rtp @returns {number | null} */
  stampOf(rtp) {
    if (!this.known) return null;
    return this.known[1] + ((rtp - this.known[0]) | 0) / RTP_RATE; // it wraps
  }

  /** @param {number} stamp @param {number} now ours @param {number} roundTrip the least @returns {number | null} */
  age(stamp, now, roundTrip) {
    if (!this.took.length) return null;
    return now - Math.min(...this.took) + roundTrip / 2 - stamp;
  }
}
