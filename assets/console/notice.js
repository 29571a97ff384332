/** The one line that says what is wrong now, or what was just done; screen readers hear it. */

export class Notice {
  /** @param {HTMLElement} line with role=status */
  constructor(line) {
    this.line = line;
    this.fading = null;
  }

  /** Stays until it is cleared. */
  warn(words) {
    clearTimeout(this.fading);
    this.show(words, 'bad');
  }

  /** Goes after some seconds. */
  tell(words) {
    this.show(words, 'good');
    clearTimeout(this.fading);
    this.fading = setTimeout(() => this.clear(), 4000);
  }

  clear() {
    this.line.hidden = true;
    this.line.textContent = '';
  }

  show(words, look) {
    this.line.textContent = words;
    this.line.className = `notice ${look}`;
    this.line.hidden = false;
  }
}
