// @ts-check
/** Controls of the sheet, each with its name: one of several, on or off, a number. */

let made = 0;

/** @param {string} tag @param {Record<string, any>} [fields] @param {(Node | string)[]} content @returns {any} */
export function make(tag, fields = {}, ...content) {
  const element = Object.assign(document.createElement(tag), fields);
  element.append(...content);
  return element;
}

/**
 * @param {string} name @param {[string, string][]} options value and words @param {string} value
 * @param {(value: string) => void} onChange
 * @returns {HTMLFieldSetElement}
 */
export function choice(name, options, value, onChange) {
  made += 1;
  const group = `choice${made}`;
  const labels = options.map(([each, words]) => {
    const button = make("input", { type: "radio", name: group, value: each, checked: each === value });
    button.addEventListener("change", () => onChange(each));
    return make("label", {}, button, words);
  });
  return make("fieldset", { className: "choice" }, make("legend", {}, name), make("div", {}, ...labels));
}

/** @param {string} name @param {boolean} on @param {(on: boolean) => void} onChange @returns {HTMLLabelElement} */
export function toggle(name, on, onChange) {
  const box = make("input", { type: "checkbox", checked: on });
  box.addEventListener("change", () => onChange(box.checked));
  return make("label", { className: "row" }, box, name);
}

/**
 * A number by pulling, by pressing less and more, or by arrow keys.
 * @param {string} name @param {{min: number, max: number, step: number}} range @param {number} value
 * @param {(value: number) => string} words for a value @param {(value: number) => void} onChange
 * @returns {HTMLDivElement}
 */
export function slider(name, { min, max, step }, value, words, onChange) {
  made += 1;
  const id = `slider${made}`;
  const bar = make("input", { type: "range", id, min, max, step, value });
  const shown = make("output", { htmlFor: id });
  const show = () => {
    shown.textContent = words(Number(bar.value));
    bar.setAttribute("aria-valuetext", shown.textContent);
  };
  bar.addEventListener("input", () => { show(); onChange(Number(bar.value)); });
  show();
  return make("div", { className: "slider" }, make("label", { htmlFor: id }, name), shown, bar);
}
