/**
 * The robot's side, where there is one: its state as server-sent events, and what is asked of it. Several pages
 * see the same state: what one does, the others show.
 */

import {ApiError, post} from './api.js';
import {connection} from './connection.js';
import {SESSION} from './session.js';

const BEAT_MS = 100;  // the server stops the robot after 300 ms without

export class Robot {
  constructor() {
    this.state = null;
    this.isHeard = false;
    this.hasStarted = false;
    this.starting = null;  // what play() waits for, until a state tells of the replay
    this.listeners = [];
    this.growth = [];
    connection.onChange(({returned}) => returned && this.listen());
    // Who has started a replay and leaves, stops it. Of a browser that is killed, the server sees the events end.
    window.addEventListener('pagehide', () => {
      if (this.starting || (this.hasStarted && this.isMoving())) post('/api/stop', {}, true).catch(() => {});
    });
    this.listen();
  }

  /** @param {function(Object|null, boolean)} listener the state, and whether it is being heard; also called now */
  follow(listener) {
    this.listeners.push(listener);
    listener(this.state, this.isHeard);
    return () => { this.listeners = this.listeners.filter((other) => other !== listener); };
  }

  /** @param {function()} listener called when the store has grown */
  onGrowth(listener) {
    this.growth.push(listener);
  }

  listen() {
    this.source?.close();
    this.source = new EventSource(`/api/events?session=${SESSION}`);
    this.source.addEventListener('state', (event) => this.tell(JSON.parse(event.data), true));
    this.source.addEventListener('behaviors', () => this.growth.forEach((listener) => listener()));
    this.source.addEventListener('error', () => {
      this.tell(this.state, false);
      // The browser tries again by itself unless it was refused; then the page asks whether anybody is there.
      if (this.source.readyState === EventSource.CLOSED) connection.lost();
    });
  }

  tell(state, isHeard) {
    this.state = state;
    this.isHeard = isHeard;
    if (this.isMoving()) this.starting = null;
    for (const listener of this.listeners) listener(state, isHeard);
  }

  /** Whether a replay is under way. */
  isMoving() {
    return !['idle', 'ready', 'stopped', 'done', 'failed', undefined].includes(this.state?.player?.state);
  }

  dryRun(request) {
    return post('/api/dry-run', request);
  }

  async play(request) {
    const starting = post('/api/play', {...request, session: SESSION});
    this.starting = starting;
    try {
      const answer = await starting;
      this.hasStarted = true;
      return answer;
    } catch (problem) {
      if (this.starting === starting) this.starting = null;
      throw problem;
    }
  }

  /** Whether a replay is under way, or was asked for and no state has told of it yet. */
  mayMove() {
    return this.isMoving() || this.starting !== null;
  }

  pause() { return post('/api/pause'); }
  resume() { return post('/api/resume'); }
  seek(t) { return post('/api/seek', {t}); }
  setRate(rate) { return post('/api/rate', {rate}); }

  /** Said again where a replay is being asked for meanwhile, which could begin after the stop. */
  async stop() {
    const {starting} = this;
    await this.sayStop();
    if (!starting) return;
    await starting.catch(() => {});
    await this.sayStop();
    if (this.starting === starting) this.starting = null;
  }

  /** Tried until the server has it: a stop that is lost is none. Throws where it cannot be said for 2 s. */
  async sayStop() {
    const until = performance.now() + 2000;
    for (;;) {
      try {
        return await post('/api/stop', {}, true);
      } catch (problem) {
        if (performance.now() > until) {
          throw new ApiError(`The stop was NOT heard: ${problem.message} Use the robot's emergency stop.`, 0);
        }
        await new Promise((resolve) => { setTimeout(resolve, 100); });
      }
    }
  }

  /** The dead-man heartbeat, until release(), or until `isHeld` is false: an end that no event told of. A beat that
   * takes too long is the server's to notice. */
  hold(isHeld, onTrouble) {
    if (this.beating || !isHeld()) return;
    const beat = () => {
      if (!isHeld()) return this.release();
      post('/api/hold', {session: SESSION}).catch((problem) => {
        this.release();
        onTrouble(problem);
      });
    };
    this.beating = setInterval(beat, BEAT_MS);
    beat();
  }

  release() {
    clearInterval(this.beating);
    this.beating = null;
  }

  /** Whether this page holds. */
  get isHolding() {
    return Boolean(this.beating);
  }
}
