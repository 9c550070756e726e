// Questionnaires and rankings: questions to fill in by mouse, finger or keyboard.

import { make, paragraphs } from "./dom.js";
import { filled } from "./words.js";

const MAX_TEXT = 2000; // as view.py has it

/** Return ranks that count from 1 without gaps, in the order of what was placed; equal stays equal. */
export function denseRanks(places) {
  const levels = [...new Set(places)].sort((a, b) => a - b);
  return places.map((place) => levels.indexOf(place) + 1);
}

/** Return whether nothing was answered. */
function isEmpty(item, kept) {
  if (item.scale === "points") return kept.value == null;
  if (item.scale === "choices") return !kept.choices?.length;
  if (item.scale === "ranking") return item.options.some((_, k) => !kept.places?.[k]);
  return !kept.text?.trim();
}

function answerTo(item, kept) {
  const answer = { item: item.id };
  if (isEmpty(item, kept)) return answer;
  if (item.scale === "points") answer.value = kept.value;
  if (item.scale === "choices") answer.choices = item.options.filter((option) => kept.choices.includes(option));
  if (item.scale === "ranking") answer.ranks = denseRanks(kept.places);
  if (item.scale === "open" || (item.other && kept.choices?.includes(item.other))) {
    answer.text = (kept.text ?? "").trim().slice(0, MAX_TEXT);
  }
  return answer;
}

export class Form {
  /**
   * view: of the participant; kept: what was filled in before, by item, changed in place;
   * on: {change(), send(answers)}.
   */
  constructor(view, words, kept, on) {
    this.view = view;
    this.words = words;
    this.kept = kept;
    this.on = on;
    this.isPaged = view.is_paged && view.screen === "questionnaire" && view.items.length > 1;
    kept.answers ??= {};
    kept.page = Math.min(kept.page ?? 0, view.items.length - 1);
    this.questions = view.items.map((item, k) => this.question(item, k));
    this.hint = make("p", { class: "hint", role: "alert" });
    this.buttons = make("div", { class: "buttons" });
    this.element = make(
      "form", { class: `form ${this.isPaged ? "paged" : ""}`, noValidate: true, on: { submit: (event) => this.submit(event) } },
      ...this.questions, this.hint, this.buttons,
    );
    this.turn(kept.page, false);
  }

  of(item) {
    return (this.kept.answers[item.id] ??= {});
  }

  changed(item, question) {
    question.classList.toggle("missing", question.classList.contains("missing") && isEmpty(item, this.of(item)));
    if (!this.element.querySelector(".missing")) this.hint.textContent = "";
    this.on.change();
  }

  question(item, index) {
    const [words, kept] = [this.words, this.of(item)];
    const legend = make("legend", {}, make("span", { class: "text", id: `q${index}`, textContent: item.text }));
    if (!item.is_required) legend.append(make("span", { class: "optional", textContent: words.optional }));
    const made = { points: "points", choices: "choices", ranking: "ranking", open: "open" }[item.scale];
    const question = make("fieldset", { class: `question ${item.scale}`, "data-item": item.id }, legend);
    question.append(...this[made](item, index, kept, () => this.changed(item, question)));
    return question;
  }

  /** One of several in a row or a column; clicking it again takes an answer that is free back. */
  radio(name, label, value, isChosen, canUndo, choose) {
    const input = make("input", { type: "radio", name, value, checked: isChosen() });
    input.addEventListener("change", () => choose(value));
    input.addEventListener("click", (event) => {
      if (canUndo && input.wasChecked && event.detail > 0) {
        input.checked = false;
        choose(null);
      }
      for (const other of document.getElementsByName(name)) other.wasChecked = other.checked;
    });
    input.wasChecked = input.checked;
    return make("label", {}, input, ...label);
  }

  points(item, index, kept, changed) {
    const own = item.points === 5 ? this.words.points : [];
    const labels = item.labels.length ? item.labels : own;
    const row = make("div", { class: "scale", "data-points": String(item.points) });
    for (let value = 1; value <= item.points; value++) {
      const label = [make("b", { textContent: value }), make("small", { textContent: labels[value - 1] ?? "" })];
      row.append(this.radio(`points-${index}`, label, value, () => kept.value === value, !item.is_required, (chosen) => {
        kept.value = chosen;
        changed();
      }));
    }
    row.addEventListener("keydown", (event) => { // digits choose, as arrows do
      const input = row.querySelectorAll("input")[Number(event.key) - 1];
      if (input && !event.ctrlKey && !event.altKey && !event.metaKey) {
        input.focus();
        input.click();
      }
    });
    return [row];
  }

  choices(item, index, kept, changed) {
    const column = make("div", { class: "options" });
    const other = this.field(kept, changed, this.words.describe);
    const show = () => { other.hidden = !kept.choices?.includes(item.other); };
    for (const option of item.options) {
      const label = [make("span", { textContent: option })];
      if (item.is_several) {
        const input = make("input", { type: "checkbox", value: option, checked: kept.choices?.includes(option) ?? false });
        input.addEventListener("change", () => {
          kept.choices = (kept.choices ?? []).filter((each) => each !== option);
          if (input.checked) kept.choices.push(option);
          show();
          if (input.checked && option === item.other) other.focus();
          changed();
        });
        column.append(make("label", {}, input, ...label));
      } else {
        column.append(this.radio(`choices-${index}`, label, option, () => kept.choices?.includes(option) ?? false,
          !item.is_required, (chosen) => {
            kept.choices = chosen === null ? [] : [chosen];
            show();
            changed();
          }));
      }
    }
    show();
    const hint = item.is_several ? make("p", { class: "how", textContent: this.words.several }) : "";
    return [hint, column, item.other ? other : ""];
  }

  field(kept, changed, label) {
    const area = make("textarea", {
      rows: 2, maxLength: MAX_TEXT, value: kept.text ?? "", placeholder: label, "aria-label": label, autocomplete: "off",
    });
    area.addEventListener("input", () => {
      kept.text = area.value;
      changed();
    });
    return area;
  }

  open(item, index, kept, changed) {
    const area = this.field(kept, changed, this.words.write);
    area.setAttribute("aria-labelledby", `q${index}`);
    return [area];
  }

  ranking(item, index, kept, changed) {
    kept.places = item.options.map((_, k) => kept.places?.[k] ?? null);
    const count = item.options.length;
    const result = make("p", { class: "order", "aria-live": "polite" });
    const [least, most] = [item.ends[0] || this.words.least, item.ends[1] || this.words.most];
    const tell = () => result.replaceChildren(...this.order(item, kept.places));
    const rows = this.names(item).map((option, k) => {
      const row = make("div", { class: "rank", role: "radiogroup", "aria-label": option });
      row.append(make("span", { class: "name", textContent: option }));
      for (let place = 1; place <= count; place++) {
        const end = place === 1 ? ` (${least})` : place === count ? ` (${most})` : "";
        const label = [make("b", { textContent: place, "aria-label": `${place}${end}` })];
        row.append(this.radio(`rank-${index}-${k}`, label, place, () => kept.places[k] === place, !item.is_required, (chosen) => {
          kept.places[k] = chosen;
          tell();
          changed();
        }));
      }
      return row;
    });
    tell();
    const ends = make("div", { class: "ends", "aria-hidden": "true" },
      make("span", { textContent: least }), make("span", { textContent: most }));
    const grid = make("div", { class: "ranks", "data-count": String(count) }, ends, ...rows);
    return [make("p", { class: "how", textContent: this.words.sameRank }), grid, result];
  }

  names(item) {
    return item.options.map((section) => filled(this.words.section, { section }));
  }

  /** Return the order in words, so that a tie is seen to be one. */
  order(item, places) {
    if (places.some((place) => !place)) return [];
    const levels = [...new Set(places)].sort((a, b) => a - b);
    const groups = levels.map((level) => this.names(item).filter((_, k) => places[k] === level));
    const texts = groups.map((names) => {
      const joined = names.join(this.words.and);
      return names.length > 1 ? filled(this.words.equal, { names: joined }) : joined;
    });
    return [make("span", { textContent: `${this.words.order} ` }), make("b", { textContent: texts.join(" → ") })];
  }

  /** Show one question of a paged form, or all of a list. */
  turn(page, isMoved = true) {
    this.kept.page = page;
    const last = this.view.items.length - 1;
    if (this.isPaged) {
      this.questions.forEach((question, k) => { question.hidden = k !== page; });
      if (isMoved) this.questions[page].querySelector("input, textarea")?.focus();
    }
    this.hint.textContent = "";
    const isEnd = !this.isPaged || page === last;
    this.buttons.replaceChildren();
    if (this.isPaged) {
      this.buttons.append(
        make("button", { type: "button", textContent: this.words.back, disabled: page === 0, class: "back", on: { click: () => this.turn(page - 1) } }),
        make("span", { class: "count", textContent: filled(this.words.question, { number: page + 1, count: last + 1 }) }),
      );
    }
    this.main = make("button", { type: "submit", class: "main", textContent: isEnd ? this.words.send : this.words.forward });
    this.buttons.append(this.main);
    if (isMoved) this.on.change();
  }

  submit(event) {
    event.preventDefault();
    const { page } = this.kept;
    const asked = this.isPaged ? [page] : this.view.items.map((_, k) => k);
    const missing = asked.filter((k) => this.view.items[k].is_required && isEmpty(this.view.items[k], this.of(this.view.items[k])));
    asked.forEach((k) => this.questions[k].classList.toggle("missing", missing.includes(k)));
    if (missing.length) {
      this.hint.textContent = filled(this.words.missing, { count: missing.length });
      this.questions[missing[0]].scrollIntoView({ block: "center" });
      this.questions[missing[0]].querySelector("input, textarea")?.focus({ preventScroll: true });
    } else if (this.isPaged && page < this.view.items.length - 1) {
      this.turn(page + 1);
    } else {
      this.on.send(this.view.items.map((item) => answerTo(item, this.of(item))));
    }
  }

  /** Take no more input while the answers are under way. */
  lock(isLocked) {
    for (const each of [...this.questions, ...this.buttons.querySelectorAll("button")]) each.disabled = isLocked;
    if (!isLocked && this.isPaged) this.buttons.querySelector(".back").disabled = this.kept.page === 0;
  }
}

/** Return the words above a form. */
export function heading(view) {
  return make("div", { class: "heading" }, make("h1", { textContent: view.title }), ...paragraphs(view.text));
}
