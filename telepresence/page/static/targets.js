// @ts-check
/** What can be pressed on the page, for those who press without a hand. */

const KINDS = "button, summary, input, select, textarea, a[href]";
const SHARE = 8; // presses from one end of a slider to the other

/** @param {Element} element */
const there = (element) => element.checkVisibility({ visibilityProperty: true }) && !element.matches(":disabled, [aria-disabled=true]");

/** Everything in there that can be pressed now, in the order of the page. @param {Element | null} slot @returns {HTMLElement[]} */
export function targets(slot) {
  return slot ? /** @type {HTMLElement[]} */ ([...slot.querySelectorAll(KINDS)].filter(there)) : [];
}

/** The groups that a scan goes through, the red stop first. @returns {HTMLElement[][]} */
export function groups() {
  const part = (/** @type {string} */ id) => document.getElementById(id);
  if (part("drive")?.hidden) return targets(part("enter")).map((target) => [target]);
  const stop = targets(part("drive")).slice(0, 1);
  const sheet = targets(part("sheet"));
  const slots = sheet.length ? chunks(sheet) : ["pad", "lookPad", "actions", "tools"].map((id) => targets(part(id)));
  return [stop, ...slots].filter((group) => group.length > 0);
}

/** A sheet of sections: headings alone, then what is in an open one. @param {HTMLElement[]} sheet */
function chunks(sheet) {
  const found = [[sheet[0]]];
  for (const target of sheet.slice(1)) {
    const heading = target.tagName === "SUMMARY";
    if (heading || found.length === 1) found.push([target]);
    else found[found.length - 1].push(target);
  }
  return found;
}

/** Press it, as a hand would. @param {HTMLElement} target */
export function press(target) {
  if (target instanceof HTMLInputElement && target.type === "range") {
    const [least, most] = [Number(target.min || 0), Number(target.max || 100)];
    const next = Number(target.value) + (most - least) / SHARE;
    target.value = String(Number(target.value) >= most ? least : Math.min(most, next));
    for (const name of ["input", "change"]) target.dispatchEvent(new Event(name, { bubbles: true }));
  } else if (target instanceof HTMLSelectElement) {
    target.selectedIndex = (target.selectedIndex + 1) % target.length;
    target.dispatchEvent(new Event("change", { bubbles: true }));
  } else if (target instanceof HTMLTextAreaElement || (target instanceof HTMLInputElement && !["checkbox", "radio"].includes(target.type))) {
    target.focus();
  } else {
    target.click();
  }
}
