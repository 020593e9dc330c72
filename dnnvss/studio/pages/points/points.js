"use strict";
// What the pages on which points are set have in common: asking the server, saying how it went, drawing.
const $ = id => document.getElementById(id);

const ask = async (path, body) => {
  const answer = await fetch(path, body && {method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify(body)});
  const value = await answer.json();
  if (!answer.ok) throw new Error(value.error || answer.statusText);
  return value;
};
const say = (text, bad = false) => { $("said").textContent = text; $("said").classList.toggle("bad", bad); };
const guarded = (work, after = () => {}) => async (...given) => { try { return await work(...given); } catch (error) { say(error.message, true); after(); } };

const element = (kind, attributes, parent) => {
  const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent.append(made);
  return made;
};
// A point, which a mouse that rests on it names.
const dot = ([cx, cy], r, fill, name, parent, more = {}) => {
  const made = element("circle", {cx, cy, r, fill, ...more}, parent);
  element("title", {}, made).textContent = name;
};
// A list of what looks wrong; where there is nothing, that.
const listed = (list, texts, nothing) => {
  const item = (text, className = "") => Object.assign(document.createElement("li"), {textContent: text, className});
  list.replaceChildren(...(texts.length ? texts.map(text => item(text)) : [item(nothing, "none")]));
};
