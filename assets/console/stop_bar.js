/**
 * Below every view, where there is a robot: what it does now, and the button that stops it. Escape does, too. Whatever
 * button moves the robot stands beside that one.
 */

import {button, element, put, refill} from './dom.js';
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
    this.movers = element('div', {class: 'movers', hidden: true});
    put(place, element('div', {class: 'state'}, this.words, this.track, this.figures), this.movers, this.stopper);
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

  /** @param {HTMLButtonElement|null} mover the button that moves the robot; null: no longer */
  beside(mover) {
    refill(this.movers, mover);
    this.movers.hidden = !mover;
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
    this.show(this.robot.state, this.robot.isHeard);  // no event comes where nothing was to stop
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
    const plays = moving && player.state !== 'to_start';
    this.track.hidden = !moving;
    this.track.max = player.duration || 1;
    if (plays) this.track.value = player.position || 0;
    else this.track.removeAttribute('value');  // nobody knows how long the way takes
    this.figures.textContent = plays ? [`${offset(player.position || 0)} of ${offset(player.duration || 0)}`,
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
