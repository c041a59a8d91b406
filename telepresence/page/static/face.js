// @ts-check
/** The pilot's camera on the robot's tablet: only of who has the robot, paused while the page is hidden, and always seen
 * by the pilot, too. */

import { hindrance, offBecause } from "./hindrance.js";
import { text } from "./language.js";
import { section, setTool, tool } from "./layout.js";
import { choices, choose, deviceChoice, open, problem } from "./media_devices.js";
import { part } from "./page.js";

const ASK_PERIOD = 1000; // ms between two requests for the same thing
const MOST_BITS = 500_000; // per second

export class Face {
  /** @param {(words: string) => void} onProblem @param {() => void} onChange */
  constructor(onProblem, onChange) {
    this.onProblem = onProblem;
    this.onChange = onChange;
    this.wanted = false;
    /** @type {MediaStreamTrack | null} */
    this.track = null;
    /** @type {RTCRtpSender | null} of the connection that there is now */
    this.sender = null;
  }

  /** @param {boolean} wanted */
  async want(wanted) {
    this.wanted = wanted;
    if (!wanted) { this.track?.stop(); this.track = null; }
    await this.apply();
  }

  /** Send what is to be sent; a hidden page sends nothing, and the robot's people see that the camera is paused. */
  async apply() {
    if (this.wanted && !this.track && !document.hidden) {
      try {
        const track = await open("video");
        if (!this.wanted || this.track) track.stop(); // switched off, or opened twice, while it was opened
        else {
          this.track = track;
          track.addEventListener("ended", () => { this.onProblem(text("sound.camera_lost")); this.want(false); });
        }
      } catch (error) {
        this.wanted = false;
        this.onProblem(problem(error));
      }
    }
    const sent = this.wanted && !document.hidden ? this.track : null;
    if (this.sender && this.sender.track !== sent) {
      await this.sender.replaceTrack(sent).catch(() => {}); // of a connection that is over
      if (sent) await limit(this.sender);
    }
    this.onChange();
  }

  /** Another device was chosen. */
  async reopen() {
    if (!this.wanted) return;
    this.track?.stop();
    this.track = null;
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
    if (!page.state?.mine) say(text("sound.take_first"));
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
    button.setAttribute("aria-disabled", String(!page.state?.mine));
    const stream = /** @type {MediaStream | null} */ (own.srcObject);
    if ((stream?.getTracks()[0] ?? null) !== face.track) {
      own.srcObject = face.track ? new MediaStream([face.track]) : null;
      cameras.refresh(); // they have names only once one was allowed
    }
    own.hidden = !face.track || !choices().mirror;
    own.classList.toggle("live", Boolean(can?.seen));
  }

  page.link.joins.push((peer) => {
    face.sender = peer.addTransceiver("video", { direction: "sendonly" }).sender;
    face.apply();
  });
  page.on("state", () => {
    const can = page.state.sound;
    const why = hindrance(page.state, "face");
    if (face.wanted && why) {
      say(text(offBecause("face", why)));
      face.want(false);
    }
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
