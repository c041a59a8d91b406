// @ts-check
/** The pilot's camera on the robot's tablet: only of who has the robot, paused while the page is hidden, and always seen
 * by the pilot, too. */

import { hindrance, offBecause, refusedBecause } from "./hindrance.js";
import { text } from "./language.js";
import { section, setTool, tool } from "./layout.js";
import { choices, choose, deviceChoice, problem } from "./media_devices.js";
import { OpenedDevice } from "./opened_device.js";
import { part } from "./page.js";

const ASK_PERIOD = 1000; // ms between two requests for the same thing
const MOST_BITS = 500_000; // per second

export class Face {
  /** @param {(words: string) => void} onProblem @param {() => void} onChange */
  constructor(onProblem, onChange) {
    this.onProblem = onProblem;
    this.onChange = onChange;
    this.wanted = false;
    this.device = new OpenedDevice("video", () => this.wanted && !document.hidden, () => this.lost());
    /** @type {RTCRtpSender | null} of the connection that there is now */
    this.sender = null;
  }

  get track() {
    return this.device.track;
  }

  /** @param {boolean} wanted */
  async want(wanted) {
    this.wanted = wanted;
    if (!wanted) this.device.close();
    await this.apply();
  }

  /** Send what is to be sent; a hidden page sends nothing, and the robot's people see that the camera is paused. */
  async apply() {
    try {
      await this.device.open();
    } catch (error) {
      this.wanted = false;
      this.onProblem(problem(error));
    }
    const sent = this.wanted && !document.hidden ? this.track : null;
    if (this.sender && this.sender.track !== sent) {
      await this.sender.replaceTrack(sent).catch(() => {}); // of a connection that is over
      if (sent) await limit(this.sender);
    }
    this.onChange();
  }

  /** The device was unplugged, or the permission taken away. */
  lost() {
    this.onProblem(text("sound.camera_lost"));
    this.want(false);
  }

  /** Another device was chosen. */
  async reopen() {
    this.device.change();
    await this.apply();
  }
}

/** @param {RTCRtpSender} sender */
async function limit(sender) {
  const parameters = sender.getParameters();
  for (const encoding of parameters.encodings ?? []) encoding.maxBitrate = MOST_BITS;
  await sender.setParameters(parameters).catch(() => {}); // before it is connected; the default does, too
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  const say = (/** @type {string} */ words) => page.emit("said", words);
  const face = new Face(say, () => show());
  const button = tool("camera", "camera_off", text("sound.camera_on"), () => {
    const why = hindrance(page, "face");
    if (why) say(text(refusedBecause("face", why)));
    else face.want(!face.wanted);
  });
  const own = document.createElement("video");
  own.id = "selfView";
  Object.assign(own, { autoplay: true, muted: true, playsInline: true, hidden: true });
  own.setAttribute("aria-label", text("sound.self_view"));
  part("over").append(own);
  const body = section("sound", text("sound.title"));
  const cameras = deviceChoice("videoinput", text("sound.camera"), () => face.reopen());
  const row = document.createElement("label");
  row.className = "row";
  const seen = document.createElement("input");
  seen.type = "checkbox";
  seen.id = "showSelf";
  seen.checked = choices().mirror;
  seen.addEventListener("change", () => { choose({ mirror: seen.checked }); show(); });
  row.append(seen, Object.assign(document.createElement("span"), { textContent: text("sound.show_self") }));
  body.append(cameras.element, row);
  let askedAt = -Infinity;

  function show() {
    const can = page.state?.sound;
    button.hidden = !can?.face;
    row.hidden = cameras.element.hidden = !can?.face;
    setTool(button, face.wanted ? "camera" : "camera_off", text(face.wanted ? "sound.camera_off" : "sound.camera_on"));
    button.setAttribute("aria-pressed", String(face.wanted));
    button.setAttribute("aria-disabled", String(hindrance(page, "face") !== ""));
    const stream = /** @type {MediaStream | null} */ (own.srcObject);
    if ((stream?.getTracks()[0] ?? null) !== face.track) {
      own.srcObject = face.track ? new MediaStream([face.track]) : null;
      cameras.refresh(); // they have names only once one was allowed
    }
    own.hidden = !face.track || !choices().mirror;
    own.classList.toggle("live", Boolean(can?.seen && !page.silent));
  }

  page.link.joins.push((peer) => {
    face.sender = peer.addTransceiver("video", { direction: "sendonly" }).sender;
    face.apply();
  });
  const allow = () => {
    const why = hindrance(page, "face");
    if (!face.wanted || !why) return;
    say(text(offBecause("face", why)));
    face.want(false);
  };
  page.on("silent", () => { allow(); show(); });
  page.on("state", () => {
    const can = page.state.sound;
    allow();
    if (can && page.state.mine && can.shows !== face.wanted && performance.now() - askedAt > ASK_PERIOD) {
      askedAt = performance.now();
      page.ask("face", face.wanted);
    }
    show();
  });
  page.on("robot", () => face.want(false));
  page.on("left", () => face.want(false));
  document.addEventListener("visibilitychange", () => face.apply());
  show();
}
