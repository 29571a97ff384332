/** While a replay goes on: pause, speed, position, and the button that has to be held for the robot to move. */

import {button, element} from './dom.js';
import {offset} from './format.js';

const RATES = [0.25, 0.5, 1, 1.5, 2];

export class ReplayControls {
  /** @param {Robot} robot @param {Object} behavior @param {Notice} notice @param {StopBar} stopBar */
  constructor(robot, behavior, notice, stopBar) {
    this.robot = robot;
    this.stopBar = stopBar;
    this.behavior = behavior;
    this.notice = notice;
    this.isHeld = false;
    this.toggle = button('Pause', () => this.tried(this.isPaused ? robot.resume() : robot.pause()), {id: 'pause'});
    this.rate = element('select', {id: 'live-rate', on: {change: () =>
      this.tried(robot.setRate(Number(this.rate.value)))}},
    RATES.map((rate) => element('option', {value: rate, selected: rate === 1}, `${rate} times`)));
    this.seek = element('input', {type: 'range', id: 'live-seek', min: 0, max: behavior.duration || 1, step: 'any',
      value: 0, on: {change: () => this.tried(robot.seek(Number(this.seek.value)))}});
    this.holder = this.makeHolder();
    this.report = element('p', {class: 'report'});
    this.place = element('section', {class: 'controls', hidden: true, 'aria-label': 'Replay under way'},
      element('div', {class: 'bar'}, this.toggle,
        element('label', {for: 'live-rate'}, 'Speed'), this.rate,
        element('label', {for: 'live-seek'}, 'Position'), this.seek), this.report);
    this.unfollow = robot.follow((state) => this.show(state));
  }

  /** Pointer or space bar held down; letting go, leaving the window or hiding the page is letting go. */
  makeHolder() {
    const made = button('Hold to run', () => {}, {class: 'hold', id: 'hold'});
    const begin = (event) => {
      if (event.repeat || (event.type === 'keydown' && event.key !== ' ')) return;
      event.preventDefault();
      if (event.pointerId !== undefined) made.setPointerCapture(event.pointerId);
      made.focus();
      made.classList.add('held');
      const isHeld = () => !made.disabled && document.activeElement === made && document.hasFocus();
      this.robot.hold(isHeld, (problem) => this.notice.warn(problem.message));
    };
    const end = (event) => {
      if (event.type === 'keyup' && event.key !== ' ') return;
      made.classList.remove('held');
      this.robot.release();
    };
    for (const name of ['pointerdown', 'keydown']) made.addEventListener(name, begin);
    for (const name of ['pointerup', 'pointercancel', 'lostpointercapture', 'keyup', 'blur']) {
      made.addEventListener(name, end);
    }
    made.addEventListener('contextmenu', (event) => event.preventDefault());  // a long touch
    this.hidden = () => { if (document.hidden) end({}); };
    document.addEventListener('visibilitychange', this.hidden);
    return made;
  }

  /** A replay was started by this page; `hold`: it goes on only while the button is held. */
  started(hold) {
    this.isHeld = hold;
    this.stopBar.beside(hold ? this.holder : null);
    this.place.hidden = false;
    if (hold) this.holder.focus();
    else this.toggle.focus();
  }

  show(state) {
    const player = state?.player;
    if (!player) return;
    const isOurs = player.behavior === this.behavior.id;
    const moving = this.robot.isMoving() && isOurs;
    if (moving) this.place.hidden = false;
    this.isPaused = player.state === 'paused';
    this.toggle.textContent = this.isPaused ? 'Go on' : 'Pause';
    this.toggle.disabled = !moving;
    this.holder.disabled = !moving;
    if (!this.robot.isHolding) this.holder.classList.remove('held');
    if (document.activeElement !== this.seek) this.seek.value = player.position || 0;
    if (isOurs && player.rate && document.activeElement !== this.rate) this.rate.value = player.rate;
    this.seek.setAttribute('aria-valuetext', offset(player.position || 0));
    const words = isOurs || !moving ? player.words || '' : '';
    if (this.report.textContent !== words) this.report.textContent = words;
  }

  async tried(asked) {
    try {
      await asked;
    } catch (problem) {
      this.notice.warn(problem.message);
    }
  }

  close() {
    this.unfollow();
    this.robot.release();
    this.stopBar.beside(null);
    document.removeEventListener('visibilitychange', this.hidden);
  }
}
