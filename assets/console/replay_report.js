/** How the last replay that was started from a page went, as its player measured it. */

import {get} from './api.js';
import {element, refill, table} from './dom.js';
import {count, duration} from './format.js';

const PARTS = {ar: 'Light', speech: 'Speech'};

const ms = (number) => (Number.isFinite(number) ? number.toFixed(1) : '');

const late = (topic, which) => (topic.published ? ms(topic.lateness_ms[which]) : '');

/** "Completed in 12.0 s." or why it ended. */
function ending(ended, report) {
  const took = duration(report.actual_s);
  return report.completed ? `Completed in ${took}.` :
    `Ended after ${took} of ${duration(report.planned_s)}: ${ended}.`;
}

function goalsText({sent, succeeded, failed, canceled}) {
  return [`${count(sent, 'goal')} sent`, `${succeeded} succeeded`, failed && `${failed} failed`,
    canceled && `${canceled} canceled`].filter(Boolean).join(', ');
}

/** Facts as sentences; what was not measured has none. */
function facts({goals, in_step: step, body, failures}) {
  const said = [];
  if (goals?.sent) said.push(`${goalsText(goals)}.`);
  if (step?.waits) {
    said.push(`Light and speech waited for the body: ${duration(step.waited_s)} in ${count(step.waits, 'wait')}.`);
  }
  for (const [part, skew] of Object.entries(step?.skew_ms || {})) {
    said.push(`${PARTS[part] || part} was within ${ms(skew.p95)} ms of the body in 95 %, ` +
      `and ${ms(skew.max)} ms at most.`);
  }
  if (body?.worst) {
    const error = Math.abs(body.worst.error).toFixed(3);
    said.push(`The joint furthest from where it ended then is ${body.worst.joint}, by ${error}.`);
  }
  if (Number.isFinite(body?.base?.distance_m)) {
    said.push(`The base stands ${(body.base.distance_m * 100).toFixed(1)} cm and ` +
      `${body.base.turn_deg.toFixed(1)}° from where it stood then.`);
  }
  for (const failed of Object.values(failures || {})) {
    if (failed.count) said.push(`${count(failed.count, 'failure')}; the first: ${failed.first.replace(/\.$/, '')}.`);
  }
  return said;
}

export class ReplayReport {
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
      const {behavior, ended, report} = await get('/api/report', {}, this.abort.signal);
      if (behavior !== this.behavior.id) return;
      this.show(ended, report);
    } catch (problem) {
      if (problem.name === 'AbortError') return;
      refill(this.place, element('p', {class: 'note bad'}, `No report: ${problem.message}`));
    }
    this.place.hidden = false;
  }

  show(ended, report) {
    const known = facts(report);
    const played = Object.entries(report.topics || {}).filter(([, topic]) => topic.lateness_ms);
    const rows = played.map(([name, topic]) => ({class: topic.problem ? 'out' : null, cells: [name,
      topic.published, (topic.skipped || 0) + (topic.refused || 0), late(topic, 'p50'), late(topic, 'max'),
      topic.problem || (topic.heard ? '' : 'nobody listened')]}));
    refill(this.place, element('h2', {}, 'How it went'),
      element('p', {}, element('strong', {}, ending(ended, report))),
      known.length ? element('ul', {}, known.map((fact) => element('li', {}, fact))) : null,
      report.notes?.length ? element('div', {class: 'note'}, element('ul', {},
        report.notes.map((note) => element('li', {}, note)))) : null,
      table('What was published', ['topic', 'sent', 'left out', 'late, typically, ms', 'at most, ms', 'but'], rows,
        [1, 2, 3, 4]));
  }

  close() {
    this.abort.abort();
    this.unfollow();
  }
}
