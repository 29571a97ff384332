/**
 * The guided calibration of a projector, for a phone in the hand that does not hold the board: what to do now in large
 * letters, where the board has been lit, and the result.
 */

import {post} from './api.js';
import {button, drawn, element, put, refill} from './dom.js';
import {andMore, count, folded} from './format.js';
import {LiveImage} from './live_image.js';
import {Question} from './question.js';

const COMMANDS = {start: 'Begin', take: 'Take a view now', discard_last: 'Forget the last view',
  solve: 'Calculate now', stop: 'Stop'};
const ANEW = 'Begin anew';
const CELL = 20;
const LOOKS = {'#': 'on', '+': 'next'};
const PHASES = {idle: 'Not started', waiting: 'Waiting for the camera', collecting: 'Taking views',
  solving: 'Calculating', verifying: 'Checking the light', timing: 'Measuring the delay', done: 'Done'};

/** What a command would destroy now, in words; nothing for one that destroys nothing. */
function loses(command, {phase, views, held_out_mm: error}) {
  const all = `${count(views, 'view')} ${views === 1 ? 'has' : 'have'} been taken`;
  if (command === 'start') {
    if (!views && !Number.isFinite(error)) return '';
    return `${all}. To begin anew is to take them all again.`;
  }
  if (command === 'stop') {
    if (phase === 'solving') return 'It is calculating. To stop is to have no result.';
    return phase === 'collecting' && views ? `${all}. What is stopped can only be begun anew.` : '';
  }
  return command === 'discard_last' && views ? `The last of ${count(views, 'view')} is deleted.` : '';
}

/** The projector's picture: which parts have been lit on a board, and where to hold it next. */
function litPicture(rows, share) {
  const width = Math.max(...rows.map((row) => row.length), 1);
  return drawn('svg', {class: 'lit', viewBox: `0 0 ${width * CELL} ${rows.length * CELL}`, role: 'img',
    'aria-label': `The projector's picture: ${Math.round(100 * share)} % of it has been on the board`},
  rows.flatMap((row, y) => [...row].map((cell, x) => drawn('rect', {class: LOOKS[cell] || 'off',
    x: x * CELL + 1, y: y * CELL + 1, width: CELL - 2, height: CELL - 2, rx: 3}))));
}

export class CalibrateView {
  constructor(view, shell) {
    this.notice = shell.notice;
    this.place = element('article', {class: 'calibrating'}, element('h1', {}, 'Calibrate the projector'));
    put(view, this.place);
    document.title = 'Calibrate · Afterglow';
    if (!shell.robot) {
      put(this.place, element('p', {class: 'note'}, 'This console reads a store; it has no robot.'));
      return;
    }
    this.advice = element('p', {class: 'advice', 'aria-live': 'polite'});
    this.problem = element('p', {class: 'note bad', role: 'alert', hidden: true});
    this.progress = element('progress', {max: 1, value: 0, 'aria-label': 'Views that have been taken'});
    this.figures = element('p', {class: 'soft figures'});
    this.lit = element('div', {});
    this.camera = new LiveImage('/api/camera', 'What the camera sees now');
    this.next = element('p', {class: 'soft'});
    this.result = element('div', {'aria-live': 'polite'});
    this.said = element('ol', {class: 'said-before'});
    this.buttons = Object.fromEntries(Object.entries(COMMANDS).map(([command, words]) => [command,
      button(words, () => this.pressed(command), {id: `calibrate-${command.replace('_', '-')}`})]));
    this.buttons.start.classList.add('main-action');
    this.question = new Question();
    this.work = element('div', {}, this.advice, this.problem, this.progress, this.figures, this.result,
      element('div', {class: 'bar commands'}, Object.values(this.buttons)), this.question.place,
      element('div', {class: 'columns'},
        element('section', {}, element('h2', {}, 'What the camera sees'), this.camera.place),
        element('section', {}, element('h2', {}, 'Where the board has been'), this.lit, this.next)),
      element('section', {}, element('h2', {}, 'Said before'), this.said));
    this.absent = element('p', {class: 'note'}, 'No calibrator is running: start calibrate.launch, with the board ' +
      'that was printed and a folder for the result.');
    put(this.place, this.absent, this.work);
    this.unfollow = shell.robot.follow((state, isHeard) => {
      this.camera.heard(isHeard ? state?.calibrator?.image : null);
      this.show(isHeard ? state?.calibrator : null);
    });
  }

  pressed(command) {
    this.question.ask(() => loses(command, this.state), this.buttons[command], () => this.ask(command));
  }

  async ask(command) {
    try {
      this.notice.tell((await post(`/api/calibrate/${command}`)).words || 'Done.');
    } catch (problem) {
      this.notice.warn(problem.message);
    }
  }

  show(state) {
    const text = JSON.stringify(state);
    if (text === this.shown) return;  // five times a second, and mostly the same
    this.shown = text;
    this.work.hidden = !state;
    this.absent.hidden = Boolean(state);
    if (!state) return;
    this.state = state;
    const {phase, views, views_wanted: wanted, coverage, said = []} = state;
    const advice = said[0] || PHASES[phase] || phase;
    if (this.advice.textContent !== advice) this.advice.textContent = advice;
    this.problem.hidden = !state.problem;
    this.problem.textContent = state.problem;
    this.progress.max = Math.max(wanted, views, 1);
    this.progress.value = views;
    this.figures.textContent = [state.doing || PHASES[phase] || phase, `${views} of ${count(wanted, 'view')}`,
      state.discarded && `${state.discarded} discarded`, `${Math.round(100 * coverage)} % of the picture`]
      .filter(Boolean).join(' · ');
    refill(this.lit, state.lit?.length ? litPicture(state.lit, coverage) : null);
    const hasNext = state.lit?.some((row) => row.includes('+'));
    this.next.textContent = hasNext ? 'The outlined part of the light has hardly been on a board: hold it there next.' :
      '';
    refill(this.result, Number.isFinite(state.held_out_mm) ? element('div', {class: 'result-box'},
      element('p', {}, 'On views that were left out, the light was ',
        element('strong', {}, `${state.held_out_mm.toFixed(2)} mm`), ' from its place.'),
      Number.isFinite(state.check_mm) ? element('p', {}, 'On a new view it is ',
        element('strong', {}, `${state.check_mm.toFixed(2)} mm`), ' off.') : null) : null);
    refill(this.said, folded(said.slice(1), (line) => line).map(
      ({first, times}) => element('li', {}, first, andMore(times))));
    const runs = phase === 'collecting' || phase === 'verifying';
    this.buttons.start.textContent = phase === 'idle' && !views ? COMMANDS.start : ANEW;
    this.buttons.take.disabled = !runs;
    this.buttons.discard_last.disabled = phase !== 'collecting' || !views;
    this.buttons.solve.disabled = phase !== 'collecting' || !views;
    this.buttons.stop.disabled = phase === 'idle' || phase === 'done';
    this.question.look();
  }

  follow() {}
  reload() {}

  close() {
    this.unfollow?.();
    this.camera?.close();
  }
}
