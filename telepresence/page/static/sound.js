// @ts-check
/** Sound both ways: the robot's in an <audio>, the microphone of who has the robot, push to talk, "say this sentence".
 *
 * The robot's sound goes straight into the element, never through Web Audio: what the element plays, the browser's echo
 * cancellation removes from the microphone. A muted microphone sends nothing at all. */

import { hindrance, offBecause, refusedBecause } from "./hindrance.js";
import { text } from "./language.js";
import { section, setTool, showSheet, tool } from "./layout.js";
import { choices, choose, deviceChoice, problem } from "./media_devices.js";
import { OpenedDevice } from "./opened_device.js";

const HELD = 400; // ms that the microphone's button is held from which on it is push to talk and not a switch
const ASK_PERIOD = 1000; // ms between two requests for the same thing
const METER_PERIOD = 150; // ms

export class Microphone {
  /** @param {(words: string) => void} onProblem @param {() => void} onChange */
  constructor(onProblem, onChange) {
    this.onProblem = onProblem;
    this.onChange = onChange;
    this.allowed = false; // only who has the robot speaks through it
    this.opened = false; // by the switch
    this.held = false; // by push to talk
    this.device = new OpenedDevice("audio", () => this.allowed && (this.opened || this.held), () => this.lost());
    /** @type {RTCRtpSender | null} of the connection that there is now */
    this.sender = null;
  }

  get track() {
    return this.device.track;
  }

  /** Whether the voice is sent. */
  get live() {
    return this.allowed && !document.hidden && (this.opened || this.held) && this.track !== null;
  }

  /** Send what is to be sent; open the device where it is wanted for the first time. */
  async apply() {
    try {
      await this.device.open();
    } catch (error) {
      this.opened = this.held = false;
      this.onProblem(problem(error));
    }
    if (this.track) this.track.enabled = this.live;
    const sent = this.live ? this.track : null;
    if (this.sender && this.sender.track !== sent) await this.sender.replaceTrack(sent).catch(() => {}); // of a connection that is over
    this.onChange();
  }

  /** The device was unplugged, or the permission taken away. */
  lost() {
    this.opened = this.held = false;
    this.onProblem(text("sound.lost"));
    this.apply();
  }

  /** Nobody should speak any more: not before the next press. */
  close() {
    this.opened = this.held = false;
    this.apply();
  }

  /** Nobody may speak any more: let go of the device, too. */
  release() {
    this.allowed = false;
    this.close();
    this.device.close();
  }

  /** Another device was chosen. */
  async reopen() {
    this.device.change();
    await this.apply();
  }
}

/** @param {import("./page.js").Page} page */
export function start(page) {
  const say = (/** @type {string} */ words) => page.emit("said", words);
  const audio = document.createElement("audio");
  audio.id = "robotSound";
  audio.autoplay = true;
  audio.setAttribute("playsinline", "");
  document.body.append(audio);
  const microphone = new Microphone(say, () => show());
  const panel = new Panel(page, microphone, audio, () => show());
  let blocked = false; // the browser plays nothing before the first touch
  let askedAt = -Infinity;

  const play = () => audio.play().then(() => { blocked = false; show(); }, (error) => {
    blocked = error.name === "NotAllowedError";
    show();
  });
  const speaker = tool("speaker", "speaker", text("sound.mute_robot"), () => {
    if (!blocked) choose({ listen: !choices().listen });
    if (choices().listen) play();
    askedAt = -Infinity;
    show();
  });
  const button = tool("microphone", "microphone_off", text("sound.unmute"), () => {});
  pushToTalk(button, microphone, () => toggle());
  tool("say", "say", text("sound.say"), () => { showSheet(true, "sound"); panel.sentence.focus(); });

  function toggle() {
    if (!microphone.allowed) { say(text(refusedBecause("speak", hindrance(page, "speak")))); return; }
    microphone.opened = !microphone.opened;
    microphone.apply();
  }

  /** Let whoever has the robot speak, and nobody else. */
  function allow() {
    const why = hindrance(page, "speak");
    if (why && microphone.allowed) {
      if (microphone.opened || microphone.held) say(text(offBecause("speak", why)));
      microphone.release();
    }
    microphone.allowed = !why;
  }

  function show() {
    const can = page.state?.sound;
    const listens = choices().listen && !blocked;
    setTool(speaker, listens ? "speaker" : "speaker_off", text(blocked ? "sound.blocked" : listens ? "sound.mute_robot" : "sound.unmute_robot"));
    speaker.setAttribute("aria-pressed", String(Boolean(listens && can?.listens && !page.silent)));
    const live = microphone.live;
    setTool(button, live ? "microphone" : "microphone_off", text(live ? "sound.mute" : "sound.unmute"));
    button.setAttribute("aria-pressed", String(live));
    button.setAttribute("aria-disabled", String(!microphone.allowed));
    for (const [element, there] of /** @type {[HTMLElement, any][]} */ ([[speaker, can?.listen], [button, can?.speak], [part("tool_say"), can?.say]]))
      element.hidden = !there;
    panel.show();
  }

  page.link.joins.push((peer) => {
    const place = peer.addTransceiver("audio", { direction: "sendrecv" });
    microphone.sender = place.sender;
    audio.srcObject = new MediaStream([place.receiver.track]);
    microphone.apply();
    play();
  });
  page.on("state", () => {
    const can = page.state.sound;
    allow();
    const wanted = choices().listen;
    if (can && can.listens !== wanted && performance.now() - askedAt > ASK_PERIOD) {
      askedAt = performance.now();
      page.ask("listen", wanted);
    }
    show();
  });
  page.on("silent", () => { allow(); show(); });
  page.on("robot", () => microphone.release());
  page.on("left", () => { microphone.release(); audio.srcObject = null; });
  // What nobody watches must not listen: a new press opens it again.
  document.addEventListener("visibilitychange", () => { if (document.hidden) microphone.close(); });
  addEventListener("pagehide", () => microphone.release());
  addEventListener("blur", () => { microphone.held = false; microphone.apply(); });
  for (const gesture of ["pointerdown", "pointerup", "click", "keydown"])
    addEventListener(gesture, () => { if (blocked && choices().listen) play(); });
  addEventListener("keydown", (event) => {
    if (!page.me || isTyping(event.target) || event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    if (event.code === "KeyM") toggle();
    else if (event.code === "KeyV") { microphone.held = true; microphone.apply(); }
  });
  addEventListener("keyup", (event) => {
    // On a Mac no key comes up while the command key is down.
    if (event.code === "KeyV" || event.key === "Meta") { microphone.held = false; microphone.apply(); }
  });
  show();
}

/** @param {string} id @returns {any} */
const part = (id) => document.getElementById(id);

/** @param {EventTarget | null} target */
export function isTyping(target) {
  return target instanceof HTMLElement && target.matches("input:not([type=checkbox], [type=range]), textarea, select");
}

/**
 * A button that switches when it is clicked, and talks while it is held.
 * @param {HTMLElement} button @param {Microphone} microphone @param {() => void} [onClick] without one it only talks
 */
function pushToTalk(button, microphone, onClick) {
  let since = 0;
  let timer = 0;
  const talk = (/** @type {boolean} */ talks) => { microphone.held = talks; microphone.apply(); };
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    since = performance.now();
    timer = window.setTimeout(() => talk(true), onClick ? HELD : 0);
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
    button.addEventListener(name, () => { clearTimeout(timer); if (microphone.held) talk(false); });
  button.addEventListener("click", (event) => {
    const held = event.detail > 0 && performance.now() - since > HELD; // a click by keyboard has no press
    if (onClick && !held) onClick();
  });
  if (onClick) return;
  button.addEventListener("keydown", (event) => { if (event.code === "Space" || event.code === "Enter") { event.preventDefault(); if (!event.repeat) talk(true); } });
  for (const name of ["keyup", "blur"]) button.addEventListener(name, () => talk(false)); // a key comes up where the focus is then
}

class Panel {
  /** @param {import("./page.js").Page} page @param {Microphone} microphone @param {HTMLAudioElement} audio @param {() => void} onChange */
  constructor(page, microphone, audio, onChange) {
    this.page = page;
    this.microphone = microphone;
    this.body = section("sound", text("sound.title"));
    const chosen = choices();
    audio.volume = chosen.volume;
    this.hint = make("p", { className: "quiet" });
    this.you = meter("sound.you");
    this.robot = meter("sound.robot");
    this.talk = /** @type {HTMLButtonElement} */ (make("button", { type: "button", id: "talk", textContent: text("sound.talk") }));
    pushToTalk(this.talk, microphone);
    const volume = /** @type {HTMLInputElement} */ (make("input", { type: "range", id: "robotVolume", min: "0", max: "1", step: "0.05", value: String(chosen.volume) }));
    volume.addEventListener("input", () => { audio.volume = choose({ volume: Number(volume.value) }).volume; });
    const headset = /** @type {HTMLInputElement} */ (make("input", { type: "checkbox", id: "headset", checked: chosen.headset }));
    headset.addEventListener("change", () => { choose({ headset: headset.checked }); microphone.reopen(); });
    const microphones = deviceChoice("audioinput", text("sound.microphone"), () => microphone.reopen());
    this.choices = [microphones];
    this.sentence = /** @type {HTMLInputElement} */ (make("input", { id: "sentence", type: "text", maxLength: 200, autocomplete: "off", enterKeyHint: "send" }));
    this.form = this.makeForm();
    this.body.append(this.hint, this.talk, this.form, this.you.element, this.robot.element, labelled("sound.volume", volume), microphones.element);
    if ("setSinkId" in audio) {
      const sink = () => audio.setSinkId(choices().audiooutput).catch(() => { choose({ audiooutput: "" }); page.emit("said", text("sound.no_device")); });
      const speakers = deviceChoice("audiooutput", text("sound.speaker"), sink);
      this.choices.push(speakers);
      this.body.append(speakers.element);
      if (chosen.audiooutput) sink();
    }
    const row = labelled("sound.headset", headset);
    row.className = "row";
    row.prepend(headset);
    this.body.append(row);
    this.hadTrack = false;
    /** @type {{context: AudioContext, analyser: AnalyserNode, track: MediaStreamTrack, samples: Float32Array<ArrayBuffer>} | null} */
    this.analysis = null;
    setInterval(() => this.measure(), METER_PERIOD);
    this.onChange = onChange;
  }

  makeForm() {
    const form = make("form", { id: "sayForm" });
    const send = make("button", { textContent: text("sound.say_it"), className: "primary" });
    const ask = async (/** @type {string} */ words) => words.trim() !== "" && await this.page.ask("say", words.trim());
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      if (await ask(this.sentence.value)) this.sentence.value = "";
    });
    const phrases = make("div", { className: "phrases" });
    for (const words of text("sound.phrases").split("|")) {
      const button = make("button", { type: "button", textContent: words });
      button.addEventListener("click", () => ask(words));
      phrases.append(button);
    }
    form.append(labelled("sound.sentence", this.sentence), send, phrases);
    return form;
  }

  show() {
    const can = this.page.state?.sound;
    this.hint.textContent = !this.page.state ? "" : this.page.silent ? text("connection.none") : !can ? text("sound.not_this_way")
      : !this.page.state.mine ? text("sound.take_first") : can.speaks ? text("sound.you_are_heard") : "";
    this.hint.hidden = !this.hint.textContent;
    this.talk.hidden = !can?.speak;
    this.talk.disabled = !this.microphone.allowed;
    this.talk.classList.toggle("held", this.microphone.held);
    this.form.hidden = !can?.say;
    if (Boolean(this.microphone.track) !== this.hadTrack) { // devices have names only once one was allowed
      this.hadTrack = Boolean(this.microphone.track);
      for (const choice of this.choices) choice.refresh();
    }
  }

  async measure() {
    const level = this.ownLevel();
    part("tool_microphone").style.setProperty("--level", level.toFixed(2));
    if (this.body.offsetParent === null) return; // nobody sees the meters
    this.you.set(level);
    let heard = 0;
    const reports = await this.page.link.peer?.getStats() ?? [];
    for (const [, report] of reports) if (report.type === "inbound-rtp" && report.kind === "audio") heard = report.audioLevel ?? 0;
    this.robot.set(heard);
  }

  /** How loud the microphone is, 0 to 1, whether it is sent or not. */
  ownLevel() {
    const track = this.microphone.track;
    if (track !== this.analysis?.track) {
      this.analysis?.context.close();
      this.analysis = null;
      if (track) {
        const context = new AudioContext();
        const analyser = new AnalyserNode(context, { fftSize: 2048 });
        new MediaStreamAudioSourceNode(context, { mediaStream: new MediaStream([track]) }).connect(analyser);
        this.analysis = { context, analyser, track, samples: new Float32Array(2048) };
      }
    }
    if (!this.analysis || !this.microphone.live) return 0;
    this.analysis.analyser.getFloatTimeDomainData(this.analysis.samples);
    return Math.sqrt(this.analysis.samples.reduce((sum, sample) => sum + sample * sample, 0) / 2048);
  }
}

/** @param {string} name of a text */
function meter(name) {
  const bar = /** @type {HTMLMeterElement} */ (make("meter", { min: 0, max: 1, low: 0, high: 0.9, value: 0 }));
  return {
    element: labelled(name, bar),
    /** @param {number} amplitude 0 to 1 */
    set(amplitude) { bar.value = Math.max(0, 1 + Math.log10(Math.max(amplitude, 1e-3)) / 3); }, // 60 dB
  };
}

/** @param {string} name of a text @param {HTMLElement} control @returns {HTMLLabelElement} */
function labelled(name, control) {
  const label = /** @type {HTMLLabelElement} */ (make("label", {}));
  label.append(make("span", { textContent: text(name) }), control);
  return label;
}

/** @param {string} kind @param {Record<string, any>} properties @returns {HTMLElement} */
function make(kind, properties) {
  return Object.assign(document.createElement(kind), properties);
}
