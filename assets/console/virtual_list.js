/**
 * A list of thousands that scrolls smoothly: only the rows in sight exist, and what they show is loaded in
 * pages when it comes into sight. Rows are links of one height; arrow keys go from one to the next.
 */

import {element} from './dom.js';

const PAGE = 200;  // rows a request
const AROUND = 6;  // rows made above and below those in sight

export class VirtualList {
  /**
   * @param {HTMLElement} scroller the element that scrolls
   * @param {{rowHeight: number, load: function(any, number, AbortSignal): Promise<{total, rows}>,
   *   draw: function(any, HTMLElement): void, key: function(any): any}} how
   *   load(after, limit): the rows after the item `after` (undefined: the first) and how many there are in all;
   *   draw: fills a row's element
   */
  constructor(scroller, how) {
    Object.assign(this, how);
    this.scroller = scroller;
    this.sheet = element('div', {class: 'sheet', role: 'list'});
    scroller.append(this.sheet);
    this.pages = new Map();
    this.shown = new Map();
    this.total = 0;
    this.abort = new AbortController();
    this.turn = 0;
    scroller.addEventListener('scroll', () => this.lay(), {passive: true});
    this.sheet.addEventListener('keydown', (event) => this.pressed(event));
    new ResizeObserver(() => this.lay()).observe(scroller);
  }

  /** Loads anew; `stay`: where it was scrolled to, showing what it has until the rest arrives. */
  async reload(stay = false) {
    this.abort.abort();
    this.abort = new AbortController();
    const turn = ++this.turn;
    const answer = await this.load(undefined, PAGE, this.abort.signal);
    if (turn !== this.turn) return;
    this.pages = new Map([[0, answer.rows]]);
    this.wanted = 0;
    this.total = answer.total;
    this.sheet.style.height = `${this.total * this.rowHeight}px`;
    for (const row of this.shown.values()) row.parentElement.remove();
    this.shown.clear();
    if (!stay) this.scroller.scrollTop = 0;
    this.lay();
  }

  /** What row `at` shows, where it is loaded. */
  item(at) {
    return this.pages.get(Math.floor(at / PAGE))?.[at % PAGE];
  }

  /** The place of a loaded item; -1 where it is not. */
  find(key) {
    for (const [page, rows] of this.pages) {
      const at = rows?.findIndex((item) => this.key(item) === key) ?? -1;
      if (at >= 0) return page * PAGE + at;
    }
    return -1;
  }

  /** Draws all rows in sight again: another one is selected. */
  refresh() {
    for (const [at, row] of this.shown) if (this.item(at)) this.draw(this.item(at), row);
  }

  /** Scrolls to row `at` and gives it the focus. */
  focus(at) {
    if (at < 0 || at >= this.total) return;
    const top = at * this.rowHeight;
    const {scrollTop, clientHeight} = this.scroller;
    if (top < scrollTop) this.scroller.scrollTop = top;
    if (top + this.rowHeight > scrollTop + clientHeight) {
      this.scroller.scrollTop = top + this.rowHeight - clientHeight;
    }
    this.lay();
    this.shown.get(at)?.focus({preventScroll: true});
  }

  lay() {
    const {scrollTop, clientHeight} = this.scroller;
    const from = Math.max(Math.floor(scrollTop / this.rowHeight) - AROUND, 0);
    const to = Math.min(Math.ceil((scrollTop + clientHeight) / this.rowHeight) + AROUND, this.total);
    for (const [at, row] of this.shown) {
      if ((at < from || at >= to) && row !== document.activeElement) {
        row.parentElement.remove();
        this.shown.delete(at);
      }
    }
    for (let at = from; at < to; at++) if (!this.shown.has(at)) this.make(at);
    this.wantPage(Math.floor(Math.max(to - 1, 0) / PAGE));
  }

  make(at) {
    const row = element('a', {class: 'row waits', 'data-at': at, tabindex: 0});
    const place = element('div', {role: 'listitem', class: 'place', 'aria-setsize': this.total,
      'aria-posinset': at + 1}, row);
    place.style.transform = `translateY(${at * this.rowHeight}px)`;
    // In order of the rows, so that the tab key goes down the list.
    const next = [...this.shown.keys()].filter((other) => other > at).sort((a, b) => a - b)[0];
    this.sheet.insertBefore(place, next === undefined ? null : this.shown.get(next).parentElement);
    this.shown.set(at, row);
    if (this.item(at)) this.draw(this.item(at), row);
  }

  /** Loads all pages down to this one, each after the last row of the one above it. */
  async wantPage(page) {
    this.wanted = Math.max(this.wanted ?? 0, page);
    if (this.isLoading || this.pages.size > this.wanted) return;
    this.isLoading = true;
    const {signal} = this.abort;
    try {
      while (!signal.aborted && this.pages.size > 0 && this.pages.size <= this.wanted) {
        const above = this.pages.get(this.pages.size - 1);
        const answer = await this.load(above[above.length - 1], PAGE, signal);
        if (signal.aborted) break;
        this.pages.set(this.pages.size, answer.rows);
        this.refresh();
        if (!answer.rows.length) break;
      }
    } catch { /* asked for again when the list is scrolled */ }
    this.isLoading = false;
    if (signal.aborted) this.lay();
  }

  pressed(event) {
    const at = Number(event.target.closest('[data-at]')?.dataset.at);
    const sight = Math.max(Math.floor(this.scroller.clientHeight / this.rowHeight) - 1, 1);
    const steps = {ArrowDown: 1, ArrowUp: -1, PageDown: sight, PageUp: -sight, Home: -at,
      End: this.total - 1 - at};
    if (Number.isNaN(at) || !Object.hasOwn(steps, event.key)) return;
    event.preventDefault();
    this.focus(Math.min(Math.max(at + steps[event.key], 0), this.total - 1));
  }
}
