/** What keys do, and the list of them. Keys without a modifier act only where nobody is writing. */

import {button, element, put} from './dom.js';

const KEYS = [
  ['/', 'search'],
  ['↓ ↑', 'go down and up the list'],
  ['Enter', 'open the one in focus; from the search, the first'],
  ['j, k', 'next and previous behavior of the list'],
  ['Space', 'watch, pause'],
  ['← →', 'a tenth of a second back and on; with Shift, a second'],
  ['+ −', 'a shorter range of time round the moment, and a longer'],
  ['0', 'the whole length'],
  ['Shift and dragging', 'on the lanes: a range; on a plot, dragging alone'],
  ['m', 'sound on, off'],
  ['l', 'copy a link to this moment'],
  ['[ ]', 'previous and next line of the story'],
  ['c', 'compare with another'],
  ['Esc', 'stop the robot, where it replays; leave what is open'],
  ['?', 'these keys'],
];

/** Whether a key goes into what has the focus, which a dialog keeps for a moment after it was closed. */
function isWriting(target) {
  return target.closest('input, textarea, select, dialog[open], [contenteditable]') !== null;
}

/**
 * @param {HTMLDialogElement} dialog
 * @param {Object<string, function(KeyboardEvent)>} actions by key; one that returns false has done nothing
 */
export function listenToKeys(dialog, actions) {
  put(dialog, element('h2', {id: 'help-title'}, 'Keys'), element('dl', {}, KEYS.map(([keys, words]) =>
    [element('dt', {}, keys), element('dd', {}, words)])), button('Close', () => dialog.close()));
  const all = {...actions, '?': () => dialog.showModal()};
  window.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
    if (isWriting(event.target)) return;
    if (event.key === ' ' && event.target.closest('button, a, summary')) return;
    if (Object.hasOwn(all, event.key) && all[event.key](event) !== false) event.preventDefault();
  });
}
