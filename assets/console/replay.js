/**
 * Replaying, in steps that cannot be skipped: what shall be replayed, a dry run as a table, and where the robot
 * would move a confirmation that names robot and speed. The server refuses motion without the dry run's token.
 */

import {get} from './api.js';
import {heading} from './behavior.js';
import {button, element, put, refill, table} from './dom.js';
import {ReplayControls} from './replay_controls.js';

/** How the last replay that was started from a page went: its player's own page of it. */
class ReplayReport {
  /** @param {Robot} robot @param {Object} behavior whose reports are shown; those of others are not */
  constructor(robot, behavior) {
    this.robot = robot;
    this.behavior = behavior;
    this.known = 0;
    this.abort = new AbortController();
    this.place = element('section', {class: 'played', hidden: true, 'aria-label': 'How it went'});
    this.unfollow = robot.follow((state) => this.look(state));
  }

  look(state) {
    const reports = state?.player?.reports || 0;
    if (this.robot.isMoving()) this.place.hidden = true;
    if (reports === this.known) return;
    this.known = reports;
    if (reports) this.load();
    else this.place.hidden = true;
  }

  async load() {
    try {
      const {behavior, ended} = await get('/api/report', {}, this.abort.signal);
      if (behavior !== this.behavior.id) return;
      refill(this.place, element('h2', {}, 'How it went'),
        element('p', {}, element('strong', {}, ended === 'completed' ? 'Completed.' : `Ended: ${ended}.`)), this.page());
    } catch (problem) {
      if (problem.name === 'AbortError') return;
      refill(this.place, element('p', {class: 'note bad'}, `No report: ${problem.message}`));
    }
    this.place.hidden = false;
  }

  /** As high as what is in it, which runs no scripts. */
  page() {
    const frame = element('iframe', {src: '/api/report/page', title: 'Report of the replay', sandbox: 'allow-same-origin'});
    const fit = () => {
      const height = frame.contentDocument?.documentElement.scrollHeight;
      if (height && Number(frame.height) !== height) frame.height = height;
    };
    frame.addEventListener('load', () => {
      if (frame.contentDocument?.contentType === 'text/html') new ResizeObserver(fit).observe(frame);
      else frame.replaceWith(element('p', {class: 'note'}, 'Its player no longer has the page of it.'));  // a refusal
    });
    return frame;
  }

  close() {
    this.abort.abort();
    this.unfollow();
  }
}

const MODALITIES = {body: 'Movement', ar: 'Light', speech: 'Speech'};

export class ReplayView {
  constructor(view, shell) {
    this.shell = shell;
    this.robot = shell.robot;
    this.abort = new AbortController();
    this.id = shell.route.now.ids[0];
    this.place = element('article', {class: 'replaying'}, element('p', {class: 'soft'}, 'Loading…'));
    put(view, this.place);
    this.reload();
  }

  async reload() {
    if (this.behavior) return;
    if (!this.robot) {
      refill(this.place, element('h1', {}, 'Replay'),
        element('p', {class: 'note'}, 'This console reads a store; it has no robot.'));
      return;
    }
    try {
      this.behavior = await get(`/api/behaviors/${this.id}`, {}, this.abort.signal);
      this.build();
    } catch (problem) {
      if (problem.name === 'AbortError') return;
      refill(this.place, element('h1', {}, `Behavior #${this.id}`),
        element('p', {class: 'note bad'}, problem.message));
    }
  }

  build() {
    const one = this.behavior;
    document.title = `Replay ${one.name} #${one.id} · Afterglow`;
    this.result = element('div', {class: 'result', 'aria-live': 'polite'});
    this.controls = new ReplayControls(this.robot, one, this.shell.notice, this.shell.stopBar);
    this.report = new ReplayReport(this.robot, one);
    refill(this.place, heading(one), element('p', {}, element('a',
      {href: this.shell.route.to('behavior', [one.id])}, 'Look at it first')),
    this.controls.place, this.report.place, this.form(), this.result);
  }

  form() {
    const one = this.behavior;
    this.boxes = Object.entries(MODALITIES).map(([key, words]) => {
      const box = element('input', {type: 'checkbox', id: `only-${key}`, value: key, checked: key !== 'body'});
      return {box, line: element('div', {class: 'check'}, box, element('label', {for: box.id}, words))};
    });
    const field = (id, label, properties) => {
      this[id] = element('input', {id: `replay-${id}`, type: 'number', ...properties});
      return element('div', {class: 'field'}, element('label', {for: `replay-${id}`}, label), this[id]);
    };
    this.loop = element('input', {type: 'checkbox', id: 'replay-loop'});
    this.hold = element('input', {type: 'checkbox', id: 'replay-hold', checked: true});
    return element('form', {class: 'replay-form', on: {submit: (event) => {
      event.preventDefault();
      this.dryRun();
    }, change: () => this.forget()}},
    element('fieldset', {}, element('legend', {}, 'What'), this.boxes.map(({line}) => line)),
    element('fieldset', {}, element('legend', {}, 'How'),
      field('rate', 'Speed, times', {value: 1, min: 0.1, max: 4, step: 0.1}),
      field('start', 'From, s', {value: 0, min: 0, max: one.duration, step: 'any'}),
      element('div', {class: 'check'}, this.loop, element('label', {for: 'replay-loop'}, 'Again and again')),
      element('div', {class: 'check'}, this.hold, element('label', {for: 'replay-hold'},
        'Only while I hold the button'))),
    element('button', {type: 'submit', class: 'main-action', id: 'dry-run'}, 'What would happen?'));
  }

  /** Another choice needs another dry run. */
  forget() {
    refill(this.result);
    if (!this.robot.mayMove()) this.shell.stopBar.beside(null);
  }

  request() {
    return {behavior: this.id, only: this.boxes.filter(({box}) => box.checked).map(({box}) => box.value).join(','),
      rate: Number(this.rate.value), start: Number(this.start.value), loop: this.loop.checked};
  }

  async dryRun() {
    const request = this.request();
    if (!request.only) {
      refill(this.result, element('p', {class: 'note bad'}, 'Choose something to replay.'));
      return;
    }
    this.forget();
    refill(this.result, element('p', {class: 'soft'}, 'Looking…'));
    try {
      this.show(await this.robot.dryRun(request), request);
    } catch (problem) {
      refill(this.result, element('p', {class: 'note bad'}, problem.message));
    }
  }

  show(dry, request) {
    const rows = [...dry.topics].sort((a, b) => b.published - a.published).map((topic) => ({
      class: topic.published ? null : 'out',
      cells: [topic.topic, topic.published ? 'yes' : 'no', topic.reason || '', topic.type]}));
    refill(this.result, element('h2', {}, 'What would be published'),
      table('What would be published', ['topic', 'published', 'why', 'type'], rows),
      dry.refusal ? element('p', {class: 'note bad'}, dry.refusal) : this.confirmation(dry, request));
  }

  confirmation(dry, request) {
    const robot = dry.robot || 'the robot';
    const start = button(dry.moves ? `Move ${robot}` : 'Show and say it', () => this.play(dry, request),
      {id: 'start', class: dry.moves ? 'main-action careful' : 'main-action', disabled: dry.moves});
    if (!dry.moves) {
      return element('div', {class: 'confirm'}, element('p', {}, 'Nothing moves.'), start);
    }
    const sure = element('input', {type: 'checkbox', id: 'sure',
      on: {change: () => { start.disabled = !sure.checked; }}});
    this.shell.stopBar.beside(start);
    return element('div', {class: 'confirm note'},
      element('p', {}, element('strong', {}, `${robot} will move: ${dry.speed}.`),
        ' It starts by the button below, beside Stop. Escape stops it, too, at any time.'),
      element('div', {class: 'check'}, sure, element('label', {for: 'sure'},
        `I see ${robot}, and nobody is in its way`)));
  }

  async play(dry, request) {
    const hold = Boolean(dry.moves && this.hold.checked);
    try {
      await this.robot.play({...request, hold, confirmed: dry.token});
      this.result.replaceChildren();
      this.controls.started(hold);
    } catch (problem) {
      this.forget();
      refill(this.result, element('p', {class: 'note bad'}, problem.message));
    }
  }

  follow() {}

  close() {
    this.abort.abort();
    this.controls?.close();
    this.report?.close();
  }
}
