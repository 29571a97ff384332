/** How stamps, durations and outcomes are said. Stamps are decimal strings of nanoseconds (BigInt). */

const pad = (number) => String(number).padStart(2, '0');

/** "2026-11-23 12:03:20" of a behavior: in the server's zone where it says so, else in the browser's. */
export function localTime(behavior) {
  if (behavior.local) return behavior.local;
  const at = new Date(Number(BigInt(behavior.begin) / 1000000n));
  return `${at.getFullYear()}-${pad(at.getMonth() + 1)}-${pad(at.getDate())} ` +
    `${pad(at.getHours())}:${pad(at.getMinutes())}:${pad(at.getSeconds())}`;
}

/** Seconds between two stamps. */
export function secondsBetween(from, to) {
  return Number(BigInt(to) - BigInt(from)) / 1e9;
}

/** "today 12:03", "yesterday 12:03" or the date and time; `today` is a day, "2026-11-23". */
export function friendlyTime(local, today) {
  const [day, clock] = local.split(' ');
  const short = (clock || '').slice(0, 5);
  if (!today) return `${day} ${short}`;
  if (day === today) return `today ${short}`;
  const before = new Date(`${today}T12:00:00Z`);
  before.setUTCDate(before.getUTCDate() - 1);
  if (day === before.toISOString().slice(0, 10)) return `yesterday ${short}`;
  return `${day} ${short}`;
}

/** "8.2 s", "3 min 05 s", "2 h 10 min". */
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return 'unknown';
  if (seconds < 59.95) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds);
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${pad(whole % 60)} s`;
  return `${Math.floor(whole / 3600)} h ${pad(Math.floor((whole % 3600) / 60))} min`;
}

/** An offset into a behavior, for a slider or a table: "1.25 s", "2:05.3". */
export function offset(seconds) {
  if (seconds < 60) return `${seconds.toFixed(2)} s`;
  return `${Math.floor(seconds / 60)}:${(seconds % 60).toFixed(1).padStart(4, '0')}`;
}

/**
 * A link that opens Foxglove's desktop program on a WebSocket of this server: "behavior/12?t=3".
 */
export function foxglove(path) {
  const socket = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/${path}`;
  return `foxglove://open?ds=foxglove-websocket&ds.url=${encodeURIComponent(socket)}`;
}

/** "1,234 messages", "1 message". */
export function count(number, noun) {
  return `${Number(number).toLocaleString('en-US')} ${noun}${Number(number) === 1 ? '' : 's'}`;
}

/** "began at 3.5 s" without its numbers: what is said of several. */
export function withoutNumbers(text) {
  return text.replace(/[\d.]+/g, '');
}

/**
 * Things that follow one another and are equal, as one: {first, last, times, all}.
 * @param {Array} things @param {function(any): string|null} same equal for equal things; null: equal to none
 */
export function folded(things, same) {
  const runs = [];
  let before = null;
  for (const one of things) {
    const now = same(one);
    if (now !== null && now === before) {
      const run = runs[runs.length - 1];
      Object.assign(run, {last: one, times: run.times + 1});
      run.all.push(one);
    } else {
      runs.push({first: one, last: one, times: 1, all: [one]});
    }
    before = now;
  }
  return runs;
}

/**
 * Lines of a story that are told as one: the same sentence said again, and goals or behaviors that went the same way,
 * however long they took. Each failure has its line.
 */
export function sameInStory({kind, text, bad}) {
  if (bad || !['said', 'goal', 'child'].includes(kind)) return null;
  return `${kind} ${kind === 'said' ? text : withoutNumbers(text)}`;
}

/** ", and 22 more like it"; nothing where there is only one. */
export function andMore(times) {
  return times > 1 ? `, and ${(times - 1).toLocaleString('en-US')} more like it` : '';
}

/** A value of a message or a parameter, as one line. */
export function plain(value) {
  if (value === null || value === undefined) return '';
  if (typeof value === 'object') return JSON.stringify(value);
  if (typeof value === 'number' && !Number.isInteger(value)) return String(+value.toPrecision(6));
  return String(value);
}

/** Ticks of a time axis: a step of 1, 2, 5, 10, 15, 30, 60 ... seconds that leaves `room` px a tick. */
export function tickStep(span, width, room = 70) {
  const least = (span * room) / Math.max(width, 1);
  const steps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400,
    21600, 43200];
  const day = 86400;
  return steps.find((step) => step >= least) || Math.ceil(least / day) * day;
}
