// @ts-check
/** A microphone or camera of this machine: open only while it is wanted, and always the one that was chosen. */

import { open } from "./media_devices.js";

export class OpenedDevice {
  /**
   * @param {"audio" | "video"} kind
   * @param {() => boolean} wanted looked at again once it has opened: the browser may have asked somebody first
   * @param {() => void} onLost it was unplugged, or the permission was taken away
   */
  constructor(kind, wanted, onLost) {
    this.kind = kind;
    this.wanted = wanted;
    this.onLost = onLost;
    /** @type {MediaStreamTrack | null} while it is open */
    this.track = null;
    this.opening = false;
    this.choice = 0; // how often another one was chosen
  }

  /** Open it if it is wanted, never two at once. Throws what the browser has against it. */
  async open() {
    if (this.opening) return; // what is wanted now is looked at when that ends
    this.opening = true;
    try {
      while (this.wanted() && !this.track) await this.openChosen();
    } finally {
      this.opening = false;
    }
  }

  async openChosen() {
    const choice = this.choice;
    const isStill = () => this.wanted() && choice === this.choice;
    let track;
    try {
      track = await open(this.kind);
    } catch (error) {
      if (isStill()) throw error;
      return;
    }
    if (!isStill()) { track.stop(); return; }
    this.track = track;
    track.addEventListener("ended", () => { if (this.track === track) { this.track = null; this.onLost(); } });
  }

  /** Let go of it, so that the browser's sign of a device in use goes out. */
  close() {
    this.track?.stop();
    this.track = null;
  }

  /** Another one was chosen: to be opened next. */
  change() {
    this.choice += 1;
    this.close();
  }
}
