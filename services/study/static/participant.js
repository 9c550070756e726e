// The participant's page: shows the screen that the study is at, and carries answers.

import { Drafts } from "./drafts.js";
import { $, fill, make, put } from "./dom.js";
import { Form, heading } from "./form.js";
import { Link } from "./link.js";
import { SCREENS, consent } from "./screens.js";
import { filled, wordsOf } from "./words.js";

const FORMS = ["questionnaire", "ranking"];
const ACTIONS = { consent: "consent", questionnaire: "answers", ranking: "ranking" };
const LABELS = { welcome: "start", rest: "ready", waiting: "ready", consent: "consentButton", thanks: "finish" };

const drafts = new Drafts();
const page = { view: null, words: wordsOf("en"), update: null, form: null, consent: null, isDone: false, refusal: [] };

const link = new Link("participant", {
  view: (view) => {
    if (link.enter(view.session)) drafts.forget();
    page.view = view;
    show();
  },
  reply: (reply, ask) => {
    if (reply.is_done) drafts.clear(ask.step);
    if (ask.step === page.view?.step) {
      page.isDone = reply.is_done;
      page.refusal = reply.is_done ? [] : reply.lines;
    }
    follow();
  },
  state: () => follow(),
});

/** Say something that has to arrive; a second click says nothing more. */
function say(action, answers = []) {
  const { step } = page.view;
  if (page.isDone || underWay()) return;
  page.refusal = [];
  link.askLasting({ action, step, answers });
  follow();
}

function underWay() {
  return page.view && link.waiting((ask) => ask.step === page.view.step && ask.action === action());
}

function action() {
  return ACTIONS[page.view.screen] ?? "ready";
}

function show() {
  const { view } = page;
  page.words = wordsOf(view.language);
  document.documentElement.lang = page.words === wordsOf("en") ? "en" : view.language;
  document.title = page.words.page;
  document.body.dataset.screen = view.screen;
  const lasting = [view.screen, view.session, view.step, view.title, view.text, view.statements, view.items, view.is_paged,
    view.language, view.is_recorded, view.screen === "score" ? view.score : view.score === null];
  fill($("screen"), () => build(view), lasting);
  page.update?.(view);
  page.consent?.look();
  follow();
}

/** Return the elements of a new screen. */
function build(view) {
  const { words } = page;
  Object.assign(page, { update: null, form: null, consent: null, isDone: false, refusal: [] });
  window.scrollTo(0, 0);
  if (FORMS.includes(view.screen)) {
    const on = { change: () => drafts.keep(), send: (answers) => say(action(), answers) };
    page.form = new Form(view, words, drafts.of(view.step), on);
    return [heading(view), page.form.element];
  }
  if (view.screen === "consent") {
    page.consent = consent(view, words, () => follow());
    return page.consent.elements;
  }
  const [elements, update] = SCREENS[view.screen](view, words);
  page.update = update;
  return elements.filter(Boolean);
}

/** Set what changes while a screen stays: button, where we are, connection. */
function follow() {
  const { view, words } = page;
  followLink();
  if (!view) return;
  const isSending = Boolean(underWay());
  const may = view.may.includes(action());
  const isBusy = isSending || page.isDone;
  page.form?.lock(isBusy || !may);
  const button = $("button");
  button.hidden = page.form !== null || !(may || isBusy);
  button.disabled = isBusy || !may || (page.consent !== null && !page.consent.isGiven());
  put(button, words[LABELS[view.screen] ?? "go"]);
  put($("status"), isSending ? (link.state === "open" ? words.sending : words.kept) : page.isDone ? words.sent : "");
  fill($("refusal"), () => [
    ...(page.refusal.length ? [make("p", { textContent: words.refused })] : []),
    ...page.refusal.map((line) => make("p", { textContent: line })),
  ], page.refusal, words.refused);
  const parts = [];
  if (view.section) parts.push(filled(words.place, view));
  if (view.game) parts.push(filled(words.placeGame, view));
  put($("place"), parts.join(" · "));
  $("progress").hidden = view.total === 0;
  $("progress").max = view.total || 1;
  $("progress").value = view.done;
  $("progress").setAttribute("aria-label", filled(words.progress, view));
  $("paused").hidden = !view.is_paused;
  put($("paused-title"), words.paused);
  put($("paused-text"), words.pausedText);
}

function followLink() {
  const { words } = page;
  $("link").hidden = !["lost", "silent"].includes(link.state);
  put($("link"), link.state === "silent" ? words.silent : words.lost);
  $("taken").hidden = !["taken", "many"].includes(link.state);
  put($("taken-title"), words.taken);
  put($("taken-text"), words.takenText);
  put($("take"), words.takeBack);
}

$("button").addEventListener("click", () => say(action()));
$("take").addEventListener("click", () => link.connect());

/** What tests read: nothing here changes anything. */
window.study = { view: () => page.view, state: () => link.state, waiting: () => link.lasting.size };
