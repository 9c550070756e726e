// Asks for the reason before something that is not easily undone.

import { $, put } from "./dom.js";

const ABOUT = {
  next: ["Skip to the next step?", "What this step measures or asks stays as incomplete as it is now.", "Skip"],
  void: ["Void this game?", "It ends, or stops counting; its data are kept and marked void.", "Void the game"],
  repeat: ["Repeat this game?", "It stops counting, and is played again as a further attempt.", "Repeat the game"],
  abort: ["Abort the session?", "The session ends here for good; what was recorded is kept.", "Abort the session"],
};

export class Dialog {
  constructor() {
    this.element = $("dialog");
    this.done = null;
    this.element.addEventListener("cancel", () => this.finish(null)); // Escape
    $("dialog-no").addEventListener("click", () => this.finish(null));
    $("reason").addEventListener("input", () => { $("dialog-yes").disabled = !$("reason").value.trim(); });
    this.element.querySelector("form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.finish($("reason").value.trim());
    });
  }

  /** Return the reason, null when the person would rather not. */
  reason(action, game) {
    const [title, text, yes] = ABOUT[action];
    put($("dialog-title"), game ? title.replace("this game", `game ${game.step}, attempt ${game.attempt}`) : title);
    put($("dialog-text"), text);
    put($("dialog-yes"), yes);
    $("reason").value = "";
    $("dialog-yes").disabled = true;
    this.finish(null);
    this.element.showModal();
    $("reason").focus();
    return new Promise((resolve) => { this.done = resolve; });
  }

  finish(reason) {
    const done = this.done;
    this.done = null;
    if (this.element.open) this.element.close();
    done?.(reason);
  }
}
