// The participant's screens, but for the forms: what is said, what counts down, what there is to press.

import { clock, draw, make, paragraphs, put, signed } from "./dom.js";

const RADIUS = 46;
const AROUND = 2 * Math.PI * RADIUS;

/** Return a clock with a ring around it, and what sets it. */
function ring(label) {
  const arc = draw("circle", { cx: 50, cy: 50, r: RADIUS, class: "arc", "stroke-dasharray": AROUND });
  const svg = draw("svg", { viewBox: "0 0 100 100", "aria-hidden": "true" }, draw("circle", { cx: 50, cy: 50, r: RADIUS }), arc);
  const digits = make("b", { class: "digits" });
  const element = make("div", { class: "ring", role: "timer" }, svg,
    make("div", { class: "inside" }, digits, make("small", { textContent: label })));
  const set = (view) => {
    element.hidden = view.seconds_left === null;
    put(digits, clock(view.seconds_left ?? 0));
    digits.classList.toggle("long", digits.textContent.length > 3);
    const share = view.seconds > 0 ? Math.min(Math.max((view.seconds_left ?? 0) / view.seconds, 0), 1) : 0;
    arc.setAttribute("stroke-dashoffset", String(AROUND * (1 - share)));
  };
  return [element, set];
}

function tones(words) {
  const tone = (kind, path, text) => make("p", { class: `tone ${kind}` },
    draw("svg", { viewBox: "0 0 60 24", "aria-hidden": "true" }, draw("path", { d: path })), make("span", { textContent: text }));
  const fast = "M2 12 q3.5-18 7 0 t7 0 t7 0 t7 0 t7 0 t7 0 t7 0 t7 0";
  const slow = "M2 12 q9-18 18 0 t18 0 t18 0";
  return make("div", { class: "tones" }, tone("high", fast, words.highTone), tone("low", slow, words.lowTone));
}

const title = (text) => make("h1", { textContent: text });

/** Each returns [elements, update(view)]; "act" says what the button means. */
export const SCREENS = {
  welcome: (view, words) => [[title(view.title || words.welcome), ...paragraphs(view.text || words.welcomeText)]],
  text: (view, words) => {
    const [timer, set] = ring(words.timeLeft);
    return [[title(view.title), ...paragraphs(view.text), timer], set];
  },
  waiting: (view, words) => [[
    make("div", { class: "breath", "aria-hidden": "true" }), title(words.waiting), ...paragraphs(view.text || words.waitingText),
  ]],
  thanks: (view, words) => [[
    title(view.step ? view.title : words.thanks), ...paragraphs(view.step ? view.text : words.thanksText),
  ]],
  countdown: (view, words) => {
    const digits = make("div", { class: "huge", role: "timer", "aria-live": "assertive" });
    const set = (now) => put(digits, Math.max(Math.ceil(now.seconds_left ?? 0), 1));
    return [[title(words.countdown), warmUp(view, words), digits, tones(words)], set];
  },
  playing: (view, words) => {
    const digits = make("div", { class: "huge", role: "timer", "aria-live": "off" });
    const bar = make("i");
    const score = make("b");
    const scores = make("p", { class: "score" }, make("span", { textContent: words.score }), score);
    const set = (now) => {
      put(digits, clock(now.seconds_left ?? 0));
      const share = now.seconds > 0 ? Math.min(Math.max((now.seconds_left ?? 0) / now.seconds, 0), 1) : 0;
      bar.style.transform = `scaleX(${share})`;
      scores.hidden = now.score === null;
      put(score, signed(now.score ?? 0));
    };
    const explored = view.game ? [] : [title(view.title), ...paragraphs(view.text)]; // no game: the target is explored
    return [[...explored, warmUp(view, words), make("p", { class: "over", textContent: words.playing }), digits, make("div", { class: "bar" }, bar),
      scores, tones(words)], set];
  },
  score: (view, words) => {
    const has = view.score !== null;
    const number = has ? make("div", { class: "huge", textContent: signed(view.score) }) : "";
    return [[title(has ? words.yourScore : words.gameOver), warmUp(view, words), number]];
  },
  rest: (view, words) => {
    const [timer, set] = ring(words.timeLeft);
    return [[title(words.rest), ...paragraphs(view.text || words.restText), timer], set];
  },
};

function warmUp(view, words) {
  return view.is_recorded || !view.game ? "" : make("p", { class: "warm-up", textContent: words.warmUp });
}

/** The consent: a text to be read to its end, then statements to be ticked. */
export function consent(view, words, changed) {
  const text = make("div", { class: "paper", tabIndex: 0, role: "document", "aria-label": view.title || words.consentTitle },
    ...paragraphs(view.text));
  const statements = view.statements.length ? view.statements : [words.consentStatement];
  const ticks = statements.map(() => make("input", { type: "checkbox", disabled: true }));
  const rows = statements.map((statement, k) => make("label", { class: "tick" }, ticks[k], make("span", { textContent: statement })));
  const hint = make("p", { class: "how", textContent: words.consentScroll });
  const state = { isRead: false };
  const look = () => {
    if (state.isRead || text.clientHeight === 0 || text.scrollTop + text.clientHeight < text.scrollHeight - 4) return;
    state.isRead = true;
    for (const tick of ticks) tick.disabled = false;
    hint.hidden = true;
    changed();
  };
  text.addEventListener("scroll", look);
  for (const tick of ticks) tick.addEventListener("change", changed);
  requestAnimationFrame(look); // it may fit without scrolling
  const elements = [title(view.title || words.consentTitle), text, hint, ...rows, make("p", { class: "small", textContent: words.consentFree })];
  return { elements, look, isGiven: () => state.isRead && ticks.every((tick) => tick.checked) };
}
