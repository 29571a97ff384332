/**
 * Making elements. Names and words come from recordings, so they may be hostile: whatever is shown becomes a
 * text node, and there is no way from here to markup, inline style or a link that is not our own.
 */

const SVG = 'http://www.w3.org/2000/svg';

function fill(made, properties, children) {
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name === 'on') {
      for (const [event, listener] of Object.entries(value)) made.addEventListener(event, listener);
    } else if (name === 'href' && !/^#|^\/api\/|^foxglove:\/\/open\?/.test(value)) {
      throw new Error(`not a link of this page: ${value}`);
    } else {
      made.setAttribute(name, value === true ? '' : value);
    }
  }
  put(made, ...children);
  return made;
}

/**
 * An HTML element.
 * @param {string} tag
 * @param {Object} properties attributes; `on`: {event: listener}; what is null or false is left out
 * @param {...(Node|string|number|null|Array)} children strings become text
 */
export function element(tag, properties = {}, ...children) {
  return fill(document.createElement(tag), properties, children);
}

/** An SVG element, as element(). */
export function drawn(tag, properties = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), properties, children);
}

/** Appends children; arrays are flattened, null and false are left out. */
export function put(parent, ...children) {
  for (const child of children.flat(Infinity)) {
    if (child === null || child === undefined || child === false) continue;
    parent.append(child instanceof Node ? child : String(child));
  }
  return parent;
}

/** Replaces all children. */
export function refill(parent, ...children) {
  parent.replaceChildren();
  return put(parent, ...children);
}

/** A button that is no form's. */
export function button(text, onClick, properties = {}) {
  return element('button', {type: 'button', on: {click: onClick}, ...properties}, text);
}

/**
 * A table with a header row. `rows`: {cells: [...], class}; `numeric`: columns that are figures.
 */
export function table(caption, columns, rows, numeric = []) {
  const kind = (at) => (numeric.includes(at) ? 'n' : null);
  return element('div', {class: 'scrolls', role: 'region', 'aria-label': caption, tabindex: 0},
    element('table', {},
      element('caption', {class: 'unseen'}, caption),
      element('thead', {}, element('tr', {}, columns.map(
        (name, at) => element('th', {scope: 'col', class: kind(at)}, name)))),
      element('tbody', {}, rows.map((row) => element('tr', {class: row.class}, row.cells.map(
        (cell, at) => element('td', {class: kind(at), 'data-label': columns[at]}, cell)))))));
}
