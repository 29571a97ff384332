/** Below every view, where there is a robot: what it does now, and the button that stops it. Escape does, too. */

import {button, element, put} from './dom.js';
import {offset} from './format.js';

export class StopBar {
  /** @param {HTMLElement} place @param {Robot} robot @param {Notice} notice */
  constructor(place, robot, notice) {
    this.robot = robot;
    this.notice = notice;
    this.words = element('p', {class: 'doing', 'aria-live': 'polite'});
    this.figures = element('p', {class: 'soft figures'});
    this.track = element('progress', {max: 1, value: 0, 'aria-label': 'Position of the replay'});
    this.stopper = button('Stop', () => this.stop(), {class: 'stop', 'aria-keyshortcuts': 'Escape'});
    put(this.stopper, element('small', {}, 'Esc'));
    put(place, element('div', {class: 'state'}, this.words, this.track, this.figures), this.stopper);
    place.hidden = false;
    document.body.toggleAttribute('data-robot', true);
    // Before anybody else gets the key: no field, list or dialog may keep it from stopping the robot.
    window.addEventListener('keydown', (event) => {
      if (event.key === 'Escape' && (this.robot.mayMove() || !this.robot.isHeard)) {
        event.preventDefault();
        this.stop();
      }
    }, {capture: true});
    robot.follow((state, isHeard) => this.show(state, isHeard));
  }

  async stop() {
    this.robot.release();
    this.words.textContent = 'Stopping…';
    try {
      await this.robot.stop();
      this.notice.tell('Stopped.');
    } catch (problem) {
      this.notice.warn(problem.message);
    }
  }

  show(state, isHeard) {
    const player = state?.player;
    this.stopper.classList.toggle('needed', this.robot.isMoving());
    if (!isHeard || !player) {
      this.say('The robot is not heard. The stop button is tried all the same.');
      this.track.hidden = true;
      this.figures.textContent = '';
      return;
    }
    const moving = this.robot.isMoving();
    this.say(player.words || player.state);
    this.track.hidden = !moving;
    this.track.max = player.duration || 1;
    this.track.value = player.position || 0;
    this.figures.textContent = moving ? [`${offset(player.position || 0)} of ${offset(player.duration || 0)}`,
      player.rate && player.rate !== 1 && `at ${player.rate} times the speed`,
      Number.isFinite(player.lateness_ms) && `late by ${player.lateness_ms.toFixed(0)} ms`,
      Number.isFinite(player.skew_ms) && `light and speech apart by ${player.skew_ms.toFixed(0)} ms`]
      .filter(Boolean).join(' · ') : '';
  }

  /** Only when it differs: a screen reader reads what is written. */
  say(words) {
    if (this.words.textContent !== words) this.words.textContent = words;
  }
}
