// @ts-check
/** The page's icons: lines in a square of 24, drawn in the colour of the text beside them. */

const NAMESPACE = "http://www.w3.org/2000/svg";

/** Each is the `d` of one path. @type {Record<string, string>} */
const PATHS = {
  up: "M12 20V5M5 12l7-7 7 7",
  down: "M12 4v15M5 12l7 7 7-7",
  left: "M20 12H5M12 5l-7 7 7 7",
  right: "M4 12h15M12 5l7 7-7 7",
  turn_left: "M8 4 4 8l4 4M4 8h9a6 6 0 0 1 0 12h-3",
  turn_right: "M16 4l4 4-4 4M20 8h-9a6 6 0 0 0 0 12h3",
  centre: "M12 3v5M12 16v5M3 12h5M16 12h5M12 11v2M11 12h2",
  along: "M12 3 5 20l7-4 7 4z",
  close: "M6 6l12 12M18 6 6 18",
  menu: "M4 7h16M4 12h16M4 17h16",
  full: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  small: "M9 4v5H4M20 9h-5V4M15 20v-5h5M4 15h5v5",
  microphone: "M12 3a3 3 0 0 0-3 3v6a3 3 0 0 0 6 0V6a3 3 0 0 0-3-3zM6 11a6 6 0 0 0 12 0M12 17v4M9 21h6",
  microphone_off: "M9 9v3a3 3 0 0 0 5 2.2M15 9V6a3 3 0 0 0-5.8-1M6 11a6 6 0 0 0 9.5 4.9M18 11a6 6 0 0 1-.4 2.2M12 17v4M9 21h6M4 3l16 18",
  speaker: "M4 9v6h4l5 5V4L8 9zM16.5 9a4 4 0 0 1 0 6M19 6a8 8 0 0 1 0 12",
  speaker_off: "M4 9v6h4l5 5V4L8 9zM17 9l5 6M22 9l-5 6",
  camera: "M4 7h10a1 1 0 0 1 1 1v8a1 1 0 0 1-1 1H4a1 1 0 0 1-1-1V8a1 1 0 0 1 1-1zM15 11l6-3v8l-6-3",
  camera_off: "M7 7h7a1 1 0 0 1 1 1v3l6-3v8l-3-1.5M14.8 16.6a1 1 0 0 1-.8.4H4a1 1 0 0 1-1-1V8a1 1 0 0 1 .6-.9M4 3l16 18",
  say: "M4 5h16v11h-9l-5 4v-4H4zM8 9h8M8 12h5",
  people: "M9 11a3.5 3.5 0 1 0 0-7 3.5 3.5 0 0 0 0 7zM2.5 20a6.5 6.5 0 0 1 13 0M16 4.5a3.5 3.5 0 0 1 0 6M18 14.5a6 6 0 0 1 3.5 5.5",
  link: "M10 14a4 4 0 0 0 6 .4l3-3a4 4 0 0 0-5.7-5.6L12 7M14 10a4 4 0 0 0-6-.4l-3 3a4 4 0 0 0 5.7 5.6L12 17",
  robot: "M6 9h12v10H6zM12 9V5M9 13v1.5M15 13v1.5M3 13v3M21 13v3M11 4h2",
  hand: "M8 12V6.5a1.5 1.5 0 0 1 3 0V11 4.5a1.5 1.5 0 0 1 3 0V11 6.5a1.5 1.5 0 0 1 3 0V15a6 6 0 0 1-6 6c-3 0-4.5-1.5-6-4l-1.7-3a1.5 1.5 0 0 1 2.6-1.500L8 14.5",
  battery: "M3 8h15v8H3zM21 11v2M6 11v2M9 11v2M12 11v2",
  signal: "M5 20v-4M10 20v-8M15 20V8M20 20V4",
  clock: "M12 21a9 9 0 1 0 0-18 9 9 0 0 0 0 18zM12 7v5l3 3",
  gamepad: "M7 8h10a5 5 0 0 1 5 5c0 3-1 5-3 5-1.5 0-2-2-4-2H9c-2 0-2.5 2-4 2-2 0-3-2-3-5a5 5 0 0 1 5-5zM8 11v4M6 13h4M15 12h.01M18 14h.01",
  gear: "M12 15a3 3 0 1 0 0-6 3 3 0 0 0 0 6zM12 3v3M12 18v3M3 12h3M18 12h3M5.6 5.600l2.1 2.100M16.3 16.300l2.1 2.100M5.6 18.400l2.1-2.100M16.3 7.700l2.1-2.1",
  eye: "M2 12c3-5 6-7 10-7s7 2 10 7c-3 5-6 7-10 7s-7-2-10-7zM12 15a3 3 0 1 0 0-6 3 3 0 0 0 0 6z",
  access: "M12 6a2 2 0 1 0 0-4 2 2 0 0 0 0 4zM4 9l6 1.500V15l-2 6M20 9l-6 1.500V15l2 6M10 10.500h4",
  warning: "M12 4 2.5 20h19zM12 10v4M12 17h.01",
  check: "M4 13l5 5L20 7",
};

/** @param {string} name of PATHS @returns {SVGSVGElement} */
export function icon(name) {
  if (!(name in PATHS)) throw new Error(`there is no icon ${name}`);
  const square = document.createElementNS(NAMESPACE, "svg");
  square.setAttribute("viewBox", "0 0 24 24");
  square.setAttribute("aria-hidden", "true");
  square.classList.add("icon");
  const path = document.createElementNS(NAMESPACE, "path");
  path.setAttribute("d", PATHS[name]);
  square.append(path);
  return square;
}

/** Draw what stands in the page itself: <button data-icon="close">. */
export function drawIcons() {
  for (const element of document.querySelectorAll("[data-icon]"))
    element.replaceChildren(icon(/** @type {HTMLElement} */ (element).dataset.icon ?? ""));
}
