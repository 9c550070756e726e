// Makes elements. Text is only ever text: nothing in these pages turns a string into HTML.

export const $ = (id) => document.getElementById(id);

/** Return an element; traits are its properties, "class", "data-*", "aria-*", "role", "for", "on". */
export function make(tag, traits = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(traits)) {
    if (name === "on") for (const [event, act] of Object.entries(value)) element.addEventListener(event, act);
    else if (name === "class") element.className = value;
    else if (name === "for" || name === "role" || name.includes("-")) element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children.filter((child) => child !== null && child !== ""));
  return element;
}

/** Return an element of a drawing. */
export function draw(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Set a text where it has changed; screen readers say again what is set again. */
export function put(element, text) {
  const wanted = String(text);
  if (element.textContent !== wanted) element.textContent = wanted;
}

/** Replace the children of an element where what they are made of has changed. */
export function fill(element, made, ...source) {
  const signature = JSON.stringify(source);
  if (element.madeOf === signature) return;
  element.madeOf = signature;
  element.replaceChildren(...made());
}

/** Return the paragraphs of a text: an empty line parts them. */
export function paragraphs(text) {
  return text.trim().split(/\n\s*\n/).filter(Boolean).map((part) => make("p", { textContent: part.trim() }));
}

export const signed = (points) => String(Math.round(points)).replace("-", "−");

/** Return seconds as a person reads them: 7, 0:45, 3:20. */
export function clock(seconds) {
  const whole = Math.max(Math.ceil(seconds), 0);
  if (whole < 60) return String(whole);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}
