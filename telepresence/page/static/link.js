// @ts-check
/** The WebRTC connection to the station. It never waits for ICE to heal: without pictures for a second it dials again. */

export const STALE = 1000; // ms without a new picture after which nobody drives by the last one
const DIAL_PERIOD = 1000; // ms between two attempts

/** What somebody who is not signed in gets. */
export class NotSignedIn extends Error {}

/** @param {string} path @param {object} [body] */
export async function post(path, body = {}) {
  const answer = await fetch(path, { method: "POST", body: JSON.stringify(body),
    headers: { "Content-Type": "application/json" } });
  const fields = await answer.json();
  if (answer.status === 401) throw new NotSignedIn(fields.reason);
  if (!answer.ok) throw new Error(fields.reason);
  return fields;
}

export class Link {
  /**
   * @param {HTMLVideoElement} video
   * @param {(state: any) => void} onState
   * @param {() => void} onSignedOut
   */
  constructor(video, onState, onSignedOut) {
    this.video = video;
    this.onState = onState;
    this.onSignedOut = onSignedOut;
    this.pictureAt = -Infinity; // when the newest picture was shown
    this.dialledAt = -Infinity;
    /** @type {RTCPeerConnection | null} */
    this.peer = null;
    /** @type {Record<string, RTCDataChannel>} */
    this.channels = {};
    this.number = 0;
    this.asked = 0;
    this.watch = this.watch.bind(this);
    if ("requestVideoFrameCallback" in video) video.requestVideoFrameCallback(this.watch);
  }

  /** @param {number} now */
  watch(now) {
    this.pictureAt = now;
    this.video.requestVideoFrameCallback(this.watch);
  }

  get stale() {
    return performance.now() - this.pictureAt > STALE;
  }

  /** Dial if the picture has stopped; to be called again and again. */
  keep() {
    const now = performance.now();
    if (this.stale && now - this.dialledAt > DIAL_PERIOD) {
      this.dialledAt = now;
      this.dial().catch((error) => {
        if (error instanceof NotSignedIn) this.onSignedOut();
      });
    }
  }

  async dial() {
    this.hangUp();
    const peer = new RTCPeerConnection();
    this.peer = peer;
    const late = { ordered: false, maxRetransmits: 0 };
    this.channels = {
      drive: peer.createDataChannel("drive", late),
      state: peer.createDataChannel("state", late),
      ask: peer.createDataChannel("ask"),
    };
    this.channels.state.onmessage = (event) => this.onState(JSON.parse(event.data));
    peer.addTransceiver("video", { direction: "recvonly" });
    peer.ontrack = (event) => {
      // A stream of its own: pictures must not wait for sound.
      this.video.srcObject = new MediaStream([event.track]);
    };
    await peer.setLocalDescription();
    const answer = await post("offer", { sdp: peer.localDescription?.sdp });
    if (this.peer === peer) await peer.setRemoteDescription({ type: "answer", sdp: answer.sdp });
  }

  hangUp() {
    this.peer?.close();
    this.peer = null;
    this.channels = {};
  }

  /** @param {number[] | null} velocity @param {string} hold */
  drive(velocity, hold) {
    const channel = this.channels.drive;
    // What waits in the channel would be late: the next one says what is true then.
    if (channel?.readyState !== "open" || channel.bufferedAmount > 0) return;
    this.number += 1;
    channel.send(JSON.stringify({ n: this.number, t: performance.now() / 1000, v: velocity, hold }));
  }

  /** @param {string} action @param {string} [to] */
  ask(action, to = "") {
    const channel = this.channels.ask;
    this.asked += 1;
    if (channel?.readyState === "open") channel.send(JSON.stringify({ id: this.asked, do: action, to }));
    if (action === "stop") post("stop").catch(() => {}); // on every way at once
  }
}
