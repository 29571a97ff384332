/** The console's page: puts search, views and the robot's bar together, and follows the address. */

import {get} from './api.js';
import {BehaviorView} from './behavior.js';
import {CalibrateView} from './calibrate.js';
import {CompareView} from './compare.js';
import {connection} from './connection.js';
import {element, refill} from './dom.js';
import {Finder} from './finder.js';
import {listenToKeys} from './keys.js';
import {LiveView} from './live.js';
import {showLogin} from './login.js';
import {Notice} from './notice.js';
import {Overview} from './overview.js';
import {ReplayView} from './replay.js';
import {Robot} from './robot.js';
import {Route} from './route.js';
import {StopBar} from './stop_bar.js';

const VIEWS = {find: Overview, when: Overview, behavior: BehaviorView, compare: CompareView, replay: ReplayView,
  live: LiveView, calibrate: CalibrateView};
const LOOK_AGAIN_MS = 5000;

const at = (id) => document.getElementById(id);

class Shell {
  constructor() {
    this.route = new Route();
    this.notice = new Notice(at('notice'));
    this.finder = new Finder(at('finder'), this.route, this.notice);
    this.robot = null;
    this.isReady = false;  // it is known whether there is a robot
    this.view = null;
    this.shown = '';
    this.counts = '';
    this.whyNoPictures = '';
    this.needsToken = true;
    this.route.onChange((now) => this.follow(now));
    connection.onChange((state) => this.reached(state));
    at('skip').addEventListener('click', () => at('view').focus());
    at('keys').addEventListener('click', () => at('help').showModal());
    listenToKeys(at('help'), this.keys());
    // The list does not wait for what the store is called.
    this.finder.follow(this.route.now);
    this.begin();
    // Beside a robot that is heard, events tell of growth.
    setInterval(() => {
      if (!document.hidden && connection.isFine && !this.robot?.isHeard) this.lookAgain();
    }, LOOK_AGAIN_MS);
  }

  get hasRobot() {
    return this.robot !== null;
  }

  async begin() {
    try {
      this.about(await get('/api/about'));
    } catch (problem) {
      if (connection.needsLogin) return;
      this.notice.warn(problem.message);
      if (!problem.status) return;  // connection asks again
    }
    if (location.hash === '') await this.openNewest();
    this.isReady = true;
    this.follow(this.route.now);
  }

  /** Whoever comes without an address sees what was recorded last; #/ is the overview. */
  async openNewest() {
    try {
      const {behaviors: [newest]} = await get('/api/behaviors', {limit: 1});
      if (newest) this.route.replace('behavior', [newest.id]);
    } catch { /* the list says why */ }
  }

  about(about) {
    this.counts = JSON.stringify(about.names);
    this.whyNoPictures = about.can_render === false ? about.why_no_render || 'it cannot' : '';
    this.needsToken = about.needs_token !== false;
    if (about.problem) this.notice.warn(about.problem);
    const today = new Date();
    refill(at('store'), element('bdi', {dir: 'ltr'}, about.store));
    at('store').title = `${about.store}, Afterglow ${about.version}`;
    this.finder.about({today: new Date(today - today.getTimezoneOffset() * 60000).toISOString().slice(0, 10),
      ...about});
    if (about.has_robot && !this.robot) {
      this.robot = new Robot();
      this.robot.onGrowth(() => this.lookAgain());
      this.stopBar = new StopBar(at('stop-bar'), this.robot, this.notice);
      for (const view of ['live', 'calibrate']) document.querySelector(`nav [data-view=${view}]`).hidden = false;
    }
  }

  /** Whether something was recorded since. Also notices that nobody answers any longer. */
  async lookAgain() {
    try {
      const about = await get('/api/about');
      if (JSON.stringify(about.names) === this.counts) return;
      this.about(about);
      this.finder.reload(true);
      if (this.view instanceof Overview) this.view.reload();
    } catch { /* connection says so */ }
  }

  reached({isFine, needsLogin, returned}) {
    if (!isFine) {
      this.notice.warn('The console does not answer; trying again. What is shown may be old.');
    } else if (needsLogin) {
      this.notice.clear();
      this.closeView();
      document.body.toggleAttribute('data-locked', true);
      showLogin(at('view'));
    } else if (returned) {
      document.body.toggleAttribute('data-locked', false);
      this.notice.tell('The console answers again.');
      this.finder.reload(true);
      if (this.view?.reload) this.view.reload();
      this.begin();
    }
  }

  /** Shows what the address says. */
  follow(now) {
    if (connection.needsLogin) return;
    this.finder.follow(now);
    if (!this.isReady) return;
    document.body.dataset.view = now.view;
    for (const link of document.querySelectorAll('nav [data-view]')) {
      link.href = this.route.to(link.dataset.view);
      if (link.dataset.view === now.view) link.setAttribute('aria-current', 'page');
      else link.removeAttribute('aria-current');
    }
    const View = VIEWS[now.view] || Overview;
    const name = View === Overview ? 'overview' : `${now.view} ${now.ids.join(' ')}`;
    if (name === this.shown) {
      this.view.follow(now);
      return;
    }
    const isFirst = this.shown === '';
    this.closeView();
    this.finder.chooseFor(null);
    document.title = 'Afterglow';
    this.shown = name;
    this.view = new View(at('view'), this);
    at('view').scrollTop = 0;
    window.scrollTo(0, 0);
    // On a phone the list is gone now, and with it what had the focus.
    if (!isFirst && !at('finder').contains(document.activeElement)) at('view').focus({preventScroll: true});
  }

  closeView() {
    this.view?.close();
    this.view = null;
    this.shown = '';
    refill(at('view'));
  }

  /** What is clicked next in the list is compared with this one. */
  chooseFor(behavior) {
    this.finder.chooseFor(behavior);
  }

  keys() {
    const stepBy = (seconds) => (event) => this.withMoment((now) =>
      now.set(now.seconds + seconds * (event.shiftKey ? 10 : 1)));
    const beside = (step) => () => {
      const other = this.finder.beside(this.route.now.ids[0], step);
      if (other) this.route.open('behavior', [other.id]);
      return Boolean(other);
    };
    return {
      '/': () => {
        if (getComputedStyle(at('finder')).display === 'none') this.route.open('find');
        this.finder.input.focus();
        this.finder.input.select();
      },
      j: beside(1),
      k: beside(-1),
      ' ': () => (this.view?.transport ? this.view.transport.toggled() : false),
      '+': () => this.withMoment((now) => now.zoom(2)),
      '-': () => this.withMoment((now) => now.zoom(0.5)),
      0: () => this.withMoment((now) => now.setRange(null)),
      m: () => (this.view?.transport?.voice ? this.view.transport.turn() : false),
      l: () => (this.view?.copyLink ? void this.view.copyLink() : false),
      ArrowLeft: stepBy(-0.1),
      ArrowRight: stepBy(0.1),
      '[': () => (this.view?.story?.step ? this.view.story.step(-1) : false),
      ']': () => (this.view?.story?.step ? this.view.story.step(1) : false),
      c: () => (this.view?.behavior && this.view instanceof BehaviorView ? this.chooseFor(this.view.behavior) :
        false),
    };
  }

  withMoment(change) {
    const moment = this.view?.moment;
    if (!moment) return false;
    moment.pause();
    change(moment);
    return true;
  }
}

new Shell();
