// The researcher's page: what happens now and next, how everybody is, and what may be done about it.

import { $, put } from "./dom.js";
import { Dialog } from "./dialog.js";
import { Link } from "./link.js";
import { showBout, showGames, showNotes, showPlan } from "./session.js";
import { showDevices, showGate, showHeart } from "./monitors.js";

const STEERS = ["begin", "pause", "resume"];
const GATE = ["arm", "disarm", "reset"];
const WITH_REASON = ["next", "void", "repeat", "abort"];
const SAID_MS = 15000;
const STOP = "To stop the robot use its emergency stop, or riposte robot disarm.";
const LOST = {
  lost: `NO CONNECTION TO THE STUDY. What you see is old; trying again … ${STOP}`,
  silent: `THE STUDY DOES NOT RESPOND. What you see is old; see its terminal. ${STOP}`,
};
const COURSES = { new: "not begun", running: "running", paused: "paused", aborted: "aborted", ended: "ended" };
const SCREENS = {
  welcome: "welcome", consent: "consent", text: "a text", countdown: "the countdown", playing: "the game", score: "the score",
  rest: "the rest timer", questionnaire: "a questionnaire", ranking: "a ranking", waiting: "“one moment, please”", thanks: "thank you",
};

const page = { view: null };
const dialog = new Dialog();
const link = new Link("researcher", {
  view: (view) => {
    link.enter(`${view.study}/${view.participant}`);
    page.view = view;
    show(view);
  },
  reply: (reply, ask) => {
    if (reply.is_done === null) said(`“${ask.action}” was not answered: see what is shown, and click again if it was not done.`, "bad");
    else if (reply.is_done) said([ask.action === "note" ? "" : `Done: ${ask.action}.`, ...reply.lines].join(" "), "good");
    else said(`Not done (${ask.action}): ${reply.lines.join("; ") || "no reason was given"}`, "bad");
  },
  state: () => followLink(),
});

/** Say what came of a click, for a while. */
function said(text, kind) {
  put($("said"), text);
  $("said").className = kind;
  clearTimeout(page.timer);
  page.timer = setTimeout(() => put($("said"), ""), SAID_MS);
}

/** Return whether a button makes sense in what is shown, beyond what the runner would accept. */
function makesSense(action, view) {
  if (action === "arm") return view.gate.mode === "disarmed";
  if (action === "reset") return view.gate.mode === "tripped";
  if (action === "void" || action === "repeat") return ["running", "paused"].includes(view.bout?.phase);
  return true;
}

function followLink() {
  $("link").hidden = link.state === "open";
  put($("link"), LOST[link.state] ?? LOST.lost);
  document.body.classList.toggle("stale", link.state !== "open");
  $("taken").hidden = link.state !== "many";
  if (page.view) showTitle(page.view);
}

function showTitle(view) {
  const alarm = link.state !== "open" || view.warnings.length > 0 || view.gate.mode === "tripped";
  document.title = `${alarm ? "⚠ " : ""}${view.participant} – ${view.study}`;
}

function show(view) {
  put($("study"), view.study);
  put($("participant"), view.participant);
  put($("course"), COURSES[view.course]);
  $("course").dataset.course = view.course;
  showTitle(view);
  showPlan(view);
  showBout(view);
  showGate(view);
  showHeart(view);
  showDevices(view);
  showGames(view, (action, game) => ask(action, game));
  showNotes(view);
  put($("screen"), (SCREENS[view.screen] ?? view.screen) + (view.is_participant_here ? "" : " — BUT NO PARTICIPANT'S PAGE IS OPEN"));
  $("screen").className = view.is_participant_here ? "" : "bad";
  put($("begin"), view.course === "new" ? "Begin the session" : "Begin this step");
  for (const action of [...STEERS, ...GATE, ...WITH_REASON]) {
    const may = view.may.includes(action) && makesSense(action, view);
    $(action).disabled = !may;
    $(action).hidden = !may && action !== "abort" && !GATE.includes(action);
  }
}

/** Ask for something; what is not easily undone wants a reason first. */
async function ask(action, game = null) {
  const step = game?.step ?? page.view?.steps[page.view.at]?.id ?? "";
  const wish = { action, step };
  if (game) wish.attempt = game.attempt;
  if (WITH_REASON.includes(action)) {
    const reason = await dialog.reason(action, game);
    if (reason === null) return;
    wish.reason = reason;
  }
  if (link.askNow(wish)) said(`Asked: ${action} …`, "");
  else said(`There is no connection: “${action}” was not sent.`, "bad");
}

for (const action of [...STEERS, ...GATE, ...WITH_REASON]) {
  $(action).addEventListener("click", (event) => {
    event.currentTarget.blur(); // a later key press is no click
    ask(action);
  });
}
$("note").addEventListener("submit", (event) => {
  event.preventDefault();
  const text = $("note-text").value.trim();
  if (!text) return;
  link.askLasting({ action: "note", step: page.view?.steps[page.view.at]?.id ?? "", text });
  $("note-text").value = "";
});
$("take").addEventListener("click", () => link.connect());

/** What tests read: nothing here changes anything. */
window.study = { view: () => page.view, state: () => link.state, waiting: () => link.lasting.size + link.passing.size };
