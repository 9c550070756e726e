// The session on the researcher's page: where it is, the game that is on, those that were, the notes.

import { $, clock, fill, make, put, signed } from "./dom.js";

const KINDS = {
  consent: "consent", instruction: "instruction", baseline: "heart-rate baseline", explore: "exploration", warm_up: "warm-up game",
  game: "game", rest: "rest", questionnaire: "questionnaire", ranking: "ranking", debrief: "debrief",
};
const seconds = (steps) => `${(steps / 100).toFixed(2)} s`;

function about(step) {
  const parts = [KINDS[step.kind] ?? step.kind];
  if (step.section) parts.push(`section ${step.section}`);
  if (step.game) parts.push(`game ${step.game}`);
  if (step.condition) parts.push(`condition ${step.condition}`);
  if (step.seconds) parts.push(`${step.seconds} s`);
  if (step.game && !step.is_recorded) parts.push("NOT RECORDED");
  return parts.join(" · ");
}

export function showPlan(view) {
  const { steps, at } = view;
  const [now, next] = [steps[at], steps[at + 1]];
  const isBegun = view.course !== "new";
  put($("count"), `${Math.min(at, steps.length)} of ${steps.length} steps done`);
  put($("now-title"), now ? now.title : "The session is over");
  put($("now-about"), now ? `${about(now)} · ${now.id}` : "");
  put($("next-title"), next ? `${next.title} (${about(next)})` : "nothing: this is the end");
  put($("timer"), view.seconds_left === null ? "" : clock(view.seconds_left));
  put($("waiting"), view.waiting_for ? `Waiting for ${view.waiting_for}` : "");
  fill($("plan"), () => steps.map((step, k) => {
    const before = steps[k - 1];
    const state = k < at ? "done" : k === at && isBegun ? "now" : "";
    return make("i", { class: `${state} ${before && before.section !== step.section ? "gap" : ""}`, "data-kind": step.kind, title: `${step.title} (${step.id})` });
  }), steps, at, isBegun);
}

export function showBout({ bout }) {
  $("bout").hidden = bout === null;
  if (bout === null) return;
  put($("score"), signed(bout.score));
  put($("game-clock"), `${bout.seconds.toFixed(1)} s`);
  put($("in-target"), seconds(bout.attack_steps));
  put($("touching"), seconds(bout.penalty_steps));
  put($("camping"), seconds(bout.camping_steps));
  put($("bout-phase"), bout.phase + (bout.reason ? `: ${bout.reason}` : ""));
}

export function showGames({ games }, ask) {
  fill($("history"), () => {
    if (!games.length) return [make("tr", {}, make("td", { class: "empty", colSpan: 6, textContent: "no game yet" }))];
    return [...games].reverse().map((game) => {
      const buttons = game.may.map((action) => make("button", {
        type: "button", textContent: `${action} …`, on: { click: () => ask(action, game) },
      }));
      const outcome = make("td", {}, game.outcome, game.reason ? make("small", { textContent: game.reason }) : "");
      return make("tr", { class: game.outcome },
        make("td", { textContent: game.step + (game.is_recorded ? "" : " (not recorded)") }),
        make("td", { textContent: game.condition }),
        make("td", { textContent: game.attempt }),
        outcome,
        make("td", { class: "number", textContent: game.score === null ? "–" : signed(game.score) }),
        make("td", {}, ...buttons));
    });
  }, games);
}

export function showNotes({ notes }) {
  fill($("kept"), () => (notes.length
    ? [...notes].reverse().map((note) => make("li", {}, make("small", { textContent: `${note.at} ${note.step}` }), note.text))
    : [make("li", { class: "empty", textContent: "no note yet" })]), notes);
}
