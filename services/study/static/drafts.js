// Answers that were not sent yet: they outlive a reload, and end with the session they were typed in.

const STORE = "riposte-study-drafts";

export class Drafts {
  constructor() {
    this.steps = JSON.parse(sessionStorage.getItem(STORE) ?? "{}");
  }

  /** Forget everything: another person sits here now. */
  forget() {
    this.steps = {};
    this.keep();
  }

  /** Return what was kept of a step: answers by item, "page", or "ticks". */
  of(step) {
    return (this.steps[step] ??= {});
  }

  clear(step) {
    delete this.steps[step];
    this.keep();
  }

  keep() {
    sessionStorage.setItem(STORE, JSON.stringify(this.steps));
  }
}
