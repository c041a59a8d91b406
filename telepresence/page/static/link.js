// @ts-check
/** The connection to the station, by WebRTC or, where that is not available, by a websocket. It never waits for ICE to
 * heal: without pictures for a second it dials again, unless the station says that it has no new ones either. */

import { Dialling, GATHERING } from "./dialling.js";
import { text } from "./language.js";
import { Slower } from "./slower.js";

export const STALE = 1000; // ms without a new picture after which nobody drives by the last one
const UNDER_WAY = 500; // ms that a picture may be on its way to the screen after the station has said that it sends it
const FRESH = 2700000; // ms for which the relay's passwords are used: they end after an hour, LIFE in relays.py
const KEPT = 10000; // ms for which a hidden page stays connected
const GLANCE = 500; // ms in which pictures come again after somebody has looked elsewhere
const IDLE = 5000; // ms without a command, after which a connection that works may be given up for a better one
const WEBRTC = "RTCPeerConnection" in globalThis;
const LATE = { ordered: false, maxRetransmits: 0 };
/** @type {Record<string, RTCDataChannelInit>} */
const CHANNELS = { drive: LATE, floor: LATE, look: LATE, state: LATE, ask: {} };

/** Names this loading of the page: its commands count from one, so the station must not take it for an earlier one. */
export const PAGE = [...crypto.getRandomValues(new Uint8Array(8))].map((byte) => byte.toString(16).padStart(2, "0")).join("");

/** What somebody who is not signed in gets. */
export class NotSignedIn extends Error {
  /** @param {any} fields what the station says besides: whether it asks for a password, why the sign-in has ended */
  constructor(fields) {
    super(fields.reason);
    this.fields = fields;
  }
}

/**
 * @param {string} path @param {object} [body] @param {AbortSignal} [signal] ends it
 * @param {boolean} [keepalive] whether it goes on when the page is closed
 */
export async function post(path, body = {}, signal = undefined, keepalive = false) {
  const answer = await fetch(path, { method: "POST", body: JSON.stringify(body), signal, keepalive,
    headers: { "Content-Type": "application/json" } });
  const fields = await answer.json();
  if (answer.status === 401) throw new NotSignedIn(fields);
  if (!answer.ok) throw new Error(fields.reason);
  return fields;
}

/** @param {string} path @param {AbortSignal} [signal] ends it */
export async function get(path, signal = undefined) {
  const answer = await fetch(path, { signal });
  const fields = await answer.json();
  if (answer.status === 401) throw new NotSignedIn(fields);
  if (!answer.ok) throw new Error(fields.reason);
  return fields;
}

/**
 * Wait for the addresses that servers tell, but not for all of them: behind a relay nobody needs any other.
 * @param {RTCPeerConnection} peer
 */
function gathered(peer) {
  return new Promise((/** @type {(value?: unknown) => void} */ resolve) => {
    setTimeout(resolve, GATHERING);
    peer.addEventListener("icegatheringstatechange", () => { if (peer.iceGatheringState === "complete") resolve(); });
    peer.addEventListener("icecandidate", (event) => { if (event.candidate?.type === "relay") resolve(); });
  });
}

/** VP8 first: it is what the station's one encoder makes. */
function preferred() {
  const codecs = RTCRtpReceiver.getCapabilities?.("video")?.codecs ?? [];
  const rank = (/** @type {{mimeType: string}} */ codec) => ["video/vp8", "video/rtx"].indexOf(codec.mimeType.toLowerCase());
  return codecs.filter((codec) => rank(codec) >= 0).sort((a, b) => rank(a) - rank(b));
}

export class Link {
  /**
   * @param {HTMLVideoElement} video
   * @param {{onState: (state: any) => void, onSaid: (words: string) => void, onSignedOut: () => void,
   *   onSent: (number: number) => void, onEcho: (number: number) => void}} listeners the last two: of what drives
   */
  constructor(video, listeners) {
    this.video = video;
    this.listeners = listeners;
    this.robot = ""; // whom it dials
    this.pictureAt = -Infinity; // when the newest picture was shown
    this.stateAt = -Infinity; // when this connection last brought a state
    /** @type {number | null} when the newest picture was taken that the station has sent by this connection, by its clock */
    this.sent = null;
    this.missedAt = -Infinity; // since when there is a newer picture at the station than was shown, if after `pictureAt`
    this.shownAt = -Infinity; // when the page was last in sight
    this.heldAt = -Infinity; // when it last drove
    this.dialling = new Dialling();
    this.attempt = new AbortController();
    this.attempts = 0;
    this.problem = ""; // why the station does not let this page in
    /** @type {RTCIceServer[] | null} which help through the internet; null before they were asked for */
    this.servers = null;
    this.serversAt = 0; // when they were given, by the time of day: it counts while the computer sleeps
    /** @type {RTCPeerConnection | null} */
    this.peer = null;
    /** @type {Slower | null} */
    this.slower = null;
    /** @type {Record<string, RTCDataChannel | import("./slower.js").Channel>} */
    this.channels = {};
    this.number = this.looked = 0;
    this.asked = 0;
    /** ms for which performance.now() has stood still: in most browsers it does while the computer sleeps. */
    this.uncounted = 0;
    /** @type {Map<number, (problem: string) => void>} */
    this.unanswered = new Map();
    /** Called with each new connection before its offer, to add tracks of their own, or because each is asked anew.
     * @type {((peer: RTCPeerConnection) => void)[]} */
    this.joins = [];
    /** @type {(rtp: number | undefined) => void} a picture is shown; what RTP calls it */
    this.onPicture = () => {};
    this.watch = this.watch.bind(this);
    document.addEventListener("visibilitychange", () => this.lookAgain());
    for (const name of ["online", "pageshow"]) addEventListener(name, () => this.dialling.hurry());
    if ("requestVideoFrameCallback" in video) video.requestVideoFrameCallback(this.watch);
  }

  /** @param {number} now @param {VideoFrameCallbackMetadata} shown */
  watch(now, shown) {
    this.pictureAt = now;
    this.onPicture(shown.rtpTimestamp);
    this.video.requestVideoFrameCallback(this.watch);
  }

  get stale() {
    return performance.now() - this.pictureAt > STALE;
  }

  /** A state has come: pictures of which it tells should be on the screen soon. @param {any} state */
  onState(state) {
    const now = performance.now();
    this.stateAt = now;
    const sent = state.picture?.[2] ?? this.sent;
    if (sent !== this.sent && now - this.pictureAt > UNDER_WAY && !this.misses) this.missedAt = now;
    this.sent = sent;
    this.listeners.onState(state);
  }

  /** Whether the station has sent pictures since the one on the screen. */
  get misses() {
    return this.missedAt > this.pictureAt;
  }

  /** Whether the connection is in order and only the robot sends no new picture: another connection would bring none. */
  get dark() {
    return performance.now() - this.stateAt <= STALE && !this.misses;
  }

  /** Whether this connection brings nothing new any more that there is. @param {number} now */
  lost(now) {
    return this.stale && (now - this.stateAt > STALE || (this.misses && now - this.missedAt > STALE));
  }

  /** Dial if the connection is lost; to be called again and again. */
  keep() {
    const now = performance.now();
    if (document.hidden) {
      if (now - this.shownAt > KEPT && (this.peer || this.slower)) this.hangUp();
      return;
    }
    this.shownAt = now;
    const better = !!this.slower?.open && WEBRTC && now - this.heldAt > IDLE && this.dialling.tryAgain(now);
    if (better) this.hangUp();
    if (better || (this.lost(now) && now > this.dialling.until)) this.dial().catch((error) => this.onFailed(error));
  }

  /** @param {any} error */
  onFailed(error) {
    if (error instanceof NotSignedIn) this.listeners.onSignedOut();
    if (error.name === "AbortError") return; // there is a later attempt
    this.problem = error instanceof TypeError ? "" : error.message; // the browser's own words are for no reader
    this.dialling.failed();
  }

  /** Somebody looks at the page again. */
  lookAgain() {
    if (!document.hidden && (this.peer || this.slower)) this.dialling.wait(performance.now(), GLANCE);
  }

  /** Which way carries pictures and messages now. @returns {"" | "webrtc" | "slower"} */
  get way() {
    if (this.slower) return this.slower.open ? "slower" : "";
    return this.peer?.connectionState === "connected" ? "webrtc" : "";
  }

  async dial() {
    if (this.way) this.dialling.works(this.way === "webrtc");
    this.hangUp();
    this.attempts += 1;
    this.dialling.begin(performance.now());
    if (this.dialling.slower || !WEBRTC) await this.dialSlower();
    else await this.dialPeer();
    this.problem = "";
  }

  /** @param {(name: string) => RTCDataChannel | import("./slower.js").Channel} channel makes one */
  open(channel) {
    this.channels = Object.fromEntries(Object.keys(CHANNELS).map((name) => [name, channel(name)]));
    this.channels.state.onmessage = (event) => this.onState(JSON.parse(event.data));
    for (const name of ["drive", "floor"]) this.channels[name].onmessage = (event) => this.listeners.onEcho(JSON.parse(event.data).n);
    this.channels.ask.onmessage = (event) => this.onAnswer(JSON.parse(event.data));
  }

  async dialPeer() {
    const age = Date.now() - this.serversAt;
    if (!this.servers || !(age >= 0 && age < FRESH)) this.take((await get("servers", this.attempt.signal)).servers);
    const peer = new RTCPeerConnection({ iceServers: this.servers ?? [], bundlePolicy: "max-bundle" });
    this.peer = peer;
    this.open((name) => peer.createDataChannel(name, CHANNELS[name]));
    for (const channel of Object.values(this.channels)) channel.onclose = () => this.onLost(peer);
    peer.onconnectionstatechange = () => { if (peer.connectionState === "failed") this.onLost(peer); };
    const pictures = peer.addTransceiver("video", { direction: "recvonly" });
    pictures.setCodecPreferences?.(preferred());
    peer.ontrack = (event) => {
      // A stream of its own: pictures must not wait for sound.
      if (event.transceiver === pictures) this.video.srcObject = new MediaStream([event.track]);
    };
    for (const join of this.joins) join(peer);
    await peer.setLocalDescription();
    if (this.servers?.length) {
      this.dialling.gather(performance.now());
      await gathered(peer);
      if (this.peer !== peer) return;
      this.dialling.ask(performance.now());
    }
    const offer = { robot: this.robot, page: PAGE, attempt: this.attempts, sdp: peer.localDescription?.sdp };
    const answer = await post("offer", offer, this.attempt.signal);
    if (this.peer !== peer) return;
    this.dialling.answered(performance.now());
    this.take(answer.servers);
    await peer.setRemoteDescription({ type: "answer", sdp: answer.sdp });
  }

  /** Use these from now on: their passwords end. @param {RTCIceServer[]} servers */
  take(servers) {
    this.servers = servers;
    this.serversAt = Date.now();
  }

  /** The station has hung up, or cannot be reached. @param {RTCPeerConnection} peer */
  onLost(peer) {
    if (this.peer !== peer) return;
    this.pictureAt = this.stateAt = -Infinity;
    this.dialling.failed();
  }

  async dialSlower() {
    await get("me", this.attempt.signal); // a websocket does not say that nobody is signed in
    this.dialling.answered(performance.now());
    const slower = new Slower(this.robot, PAGE, this.attempts);
    this.slower = slower;
    this.dialling.slows(performance.now());
    this.open((name) => slower.channel(name));
    this.video.srcObject = slower.stream;
  }

  hangUp() {
    this.attempt.abort();
    this.attempt = new AbortController();
    this.peer?.close();
    this.slower?.close();
    this.peer = this.slower = null;
    this.stateAt = this.missedAt = -Infinity;
    this.sent = null;
    this.channels = {};
    for (const resolve of this.unanswered.values()) resolve(text("connection.none"));
    this.unanswered.clear();
  }

  /** @param {number[] | null} velocity @param {string} hold */
  drive(velocity, hold) {
    if (velocity) this.heldAt = performance.now();
    this.command("drive", { v: velocity, hold });
  }

  /** @param {import("./floor.js").Point} point where to drive to @param {number} speed m/s @param {string} hold */
  point({ at, press, stamp }, speed, hold) {
    this.heldAt = performance.now();
    this.command("floor", { at, press, stamp, speed, hold });
  }

  /** The clock that dates what may move the robot [s]: one that missed a sleep would make everything after it look late. */
  get seconds() {
    return (performance.now() + this.uncounted) / 1000;
  }

  /** Send what may move the robot, with a number and this browser's clock. @param {string} name of a channel @param {object} fields */
  command(name, fields) {
    const channel = this.channels[name];
    // What waits in the channel would be late: the next one says what is true then.
    if (channel?.readyState !== "open" || channel.bufferedAmount > 0) return;
    this.number += 1;
    channel.send(JSON.stringify({ n: this.number, t: this.seconds, ...fields }));
    this.listeners.onSent(this.number);
  }

  /** @param {import("./gaze.js").Look} look */
  look(look) {
    const channel = this.channels.look;
    if (channel?.readyState !== "open" || channel.bufferedAmount > 0) return;
    this.looked += 1;
    channel.send(JSON.stringify({ n: this.looked, t: this.seconds, ...look }));
  }

  /** Dial now, whatever there is. */
  redial() {
    this.pictureAt = this.stateAt = -Infinity;
    this.dialling.works(true);
    this.dialling.hurry();
    this.keep();
  }

  /**
   * @param {string} action @param {any} value
   * @returns {Promise<string>} why not, or ""; what drive_lease is asked is answered as soon as it is passed on: what it
   * refuses is said, what it does is in the state
   */
  ask(action, value) {
    const channel = this.channels.ask;
    this.asked += 1;
    const id = this.asked;
    if (action === "stop") post("stop", { robot: this.robot, page: PAGE }).catch(() => {}); // on every way at once
    if (channel?.readyState !== "open") return Promise.resolve(text("connection.none"));
    channel.send(JSON.stringify({ id, do: action, with: value }));
    return new Promise((resolve) => this.unanswered.set(id, resolve));
  }

  /** @param {{id: number, text: string}} answer */
  onAnswer({ id, text: words }) {
    const resolve = this.unanswered.get(id);
    this.unanswered.delete(id);
    if (resolve) resolve(words);
    else this.listeners.onSaid(words);
  }
}
