/**
 * A question before something is destroyed. It stands below its button, not in a dialog: that would cover the robot's
 * stop, or keep keys from it.
 */

import {button, element, refill} from './dom.js';

export class Question {
  constructor() {
    this.place = element('div', {class: 'note question', role: 'group', 'aria-live': 'assertive', hidden: true,
      on: {keydown: (event) => { if (event.key === 'Escape' && !event.defaultPrevented) this.leave(); }}});
  }

  /**
   * Does it at once where nothing is lost, else when it is confirmed.
   * @param {function(): string} loses what would be lost now; empty: nothing
   * @param {HTMLButtonElement} asked what was pressed, whose words the confirmation has
   * @param {function()} act
   */
  ask(loses, asked, act) {
    this.leave();
    if (!loses()) {
      act();
      return;
    }
    Object.assign(this, {loses, asked});
    this.words = element('p', {}, loses());
    const keep = button('No', () => this.leave(), {id: 'question-no'});
    refill(this.place, this.words, element('div', {class: 'bar commands'},
      button(asked.textContent, () => { this.leave(); act(); }, {class: 'main-action careful', id: 'question-yes'}),
      keep));
    this.place.hidden = false;
    keep.focus();
    this.place.scrollIntoView({block: 'nearest'});
  }

  /** What is lost may have changed; a question about nothing is withdrawn. */
  look() {
    if (this.place.hidden) return;
    const words = this.asked.disabled ? '' : this.loses();
    if (!words) this.leave();
    else if (this.words.textContent !== words) this.words.textContent = words;
  }

  leave() {
    if (this.place.hidden) return;
    this.place.hidden = true;
    refill(this.place);
    this.asked.focus();
  }
}
