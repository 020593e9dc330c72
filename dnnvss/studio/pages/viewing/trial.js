"use strict";
// One trial: its videos, played in step or one after the other, and what is asked about them.
const $ = id => document.getElementById(id);
const element = (name, parent, text, attributes = {}) => {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent?.append(made);
  return made;
};
const stimulus = new Map(TEST.stimuli.map(s => [s.id, s]));
const loaded = new Map();  // videos that are being fetched ahead, by stimulus
const scored = TEST.kind === "dscqs" || TEST.kind === "single";

// A video of a stimulus; fetched ahead, it is taken from there.
function fetched(id) {
  if (!loaded.has(id)) {
    const video = element("video", null, undefined, {preload: "auto", playsinline: "", disablepictureinpicture: "", tabindex: "-1"});
    video.src = `stimuli/${id}.mp4`;
    loaded.set(id, video);
  }
  return loaded.get(id);
}
const event = (video, name) => new Promise((resolve, reject) => {
  video.addEventListener(name, resolve, {once: true});
  video.addEventListener("error", () => reject(new Error("A video cannot be played here. Please load the page again, or take another browser.")), {once: true});
});
const ready = async video => {
  if (video.error) throw new Error("A video cannot be played here. Please load the page again, or take another browser.");
  if (video.readyState < 4) await event(video, "canplaythrough");
};
const rewound = async video => {
  video.playbackRate = 1;
  if (video.currentTime === 0 && !video.ended) return;
  const done = event(video, "seeked");
  video.currentTime = 0;
  await done;
};

// Only the first of several is heard. The others are turned down and not muted, so that all start by the same path; a
// device that knows no volume of a video mutes them.
function quiet(video, k) {
  video.volume = k ? 0 : 1;
  video.muted = k > 0 && video.volume > 0;
}

// Milliseconds by which the second of a pair is told to begin after the first, so that both do begin together: a video
// that is heard takes a little longer to start. Every pair that is played says how much.
let lead = 0;
const TRIES = 4;
const lag = (first, second) => 1000 * (first.currentTime - second.currentTime);  // of the second behind the first

// The first picture of a video that has moved on, or the next one shown.
const moved = video => new Promise(resolve => {
  if (!video.requestVideoFrameCallback) return resolve();
  const look = (now, picture) => { if (picture.mediaTime > 0) resolve(); else video.requestVideoFrameCallback(look); };
  return video.requestVideoFrameCallback(look);
});

// Begin, and say by how many milliseconds the second lagged behind the first when both had moved; null of a single one and
// where no picture was shown.
async function begin(videos) {
  const pictures = videos.map(moved);
  await Promise.all(videos.map(async (video, k) => {
    const wait = k ? lead : -lead;
    if (videos.length > 1 && wait > 0) await new Promise(resolve => setTimeout(resolve, wait));
    await video.play();
  }));
  if (videos.length < 2) return null;
  const seen = await Promise.race([Promise.all(pictures), event(videos[0], "ended").then(() => null)]);
  if (!seen) return null;  // a page that nobody looks at shows no picture
  const late = lag(...videos);
  lead = Math.max(-200, Math.min(200, lead - 0.7 * late));
  return late;
}

// Play videos to their end. Two begin within a picture of each other, or begin again; the second, which is not heard, is
// then kept within half a picture of the first. How far apart they began is returned.
async function together(videos, rate) {
  await Promise.all(videos.map(ready));
  videos.forEach(quiet);
  let ends = [], late = null;
  for (let tried = 0; tried < TRIES; tried++) {
    videos.forEach(v => v.pause());
    await Promise.all(videos.map(rewound));
    ends = videos.map(v => event(v, "ended"));
    late = await begin(videos);
    if (late === null || Math.abs(late) <= 1000 / rate) break;
  }
  const [first, second] = videos;
  let open = true;
  const follow = () => {
    const off = lag(first, second);
    second.playbackRate = Math.abs(off) < 500 / rate ? 1 : 1 + Math.max(-0.1, Math.min(0.1, off / 400));
    if (open) requestAnimationFrame(follow);
  };
  if (second) follow();
  await Promise.all(ends);
  open = false;
  return late;
}

class Trial {
  // number: of the trial; practice: whether it does not count; done: is given the row of the answer.
  constructor(number, practice, done) {
    Object.assign(this, {number, practice, done, trial: TEST.trials[number], started: performance.now(), times: 0, apart: null,
      busy: false, whole: false, choice: null, word: null, scores: []});
    this.heard = new Set();
    this.videos = this.trial.stimuli.map(fetched);
    this.draw();
  }

  draw() {
    $("tried").hidden = !this.practice;
    $("check").hidden = this.trial.expect === null;
    if (this.trial.expect !== null) $("check").textContent = this.demand();
    $("question").textContent = TEST.question;
    $("said").textContent = "";
    $("videos").className = this.videos.length > 1 ? "two" : "one";
    $("videos").replaceChildren();
    const names = this.videos.length === 1 ? [""] : TEST.kind === "dscqs" ? ["A", "B"] : [TEST.labels[0] || "Left", TEST.labels[1] || "Right"];
    this.figures = this.videos.map((video, k) => {
      const figure = element("figure", $("videos"));
      figure.append(video);
      if (names[k]) element("figcaption", figure, names[k]);
      return figure;
    });
    $("plays").hidden = TEST.kind !== "dscqs";
    $("answer").replaceChildren();
    $("answer").className = TEST.kind === "dscqs" ? "scales" : "";
    this.controls = [];
    if (TEST.kind === "preference") this.options(["left", "right", ...(TEST.tie ? ["tie"] : [])], TEST.labels, ["Left", "Right", "No difference"]);
    else if (TEST.kind === "turing") this.options(["real", "synthetic"], TEST.labels, ["Real", "Synthetic"]);
    else if (this.trial.choices.length) this.options(this.trial.choices, this.trial.choices, []);
    else if (TEST.kind === "intelligibility") this.typed();
    else this.videos.forEach((_, k) => this.slider(k, names[k]));
    $("keys").textContent = `Keys: Space plays, ${this.keys()}Enter goes on.`;
    this.refresh();
  }

  demand() {
    const named = {left: TEST.labels[0] || "Left", right: TEST.labels[1] || "Right", real: TEST.labels[0] || "Real", synthetic: TEST.labels[1] || "Synthetic"};
    if (this.trial.expect === "least" || this.trial.expect === "most")
      return `Attention check: whatever you see, put every scale at its ${this.trial.expect === "least" ? "left" : "right"} end.`;
    if (TEST.kind === "intelligibility" && !this.trial.choices.length) return `Attention check: whatever you see, please type the word “${this.trial.expect}”.`;
    return `Attention check: whatever you see, please choose “${named[this.trial.expect] || this.trial.expect}”.`;
  }

  keys() {
    if (TEST.kind === "preference") return TEST.tie ? "←, → and ↓ choose, " : "← and → choose, ";
    if (scored) return "Tab and arrows move the scales, ";
    return this.controls.length > 1 ? "numbers choose, " : "";
  }

  options(values, labels, fallback) {
    const row = element("div", $("answer"), undefined, {class: "row", role: "radiogroup", "aria-label": TEST.question});
    values.forEach((value, k) => {
      const button = element("button", row, labels[k] || fallback[k] || value, {role: "radio", "aria-checked": "false", "data-value": value});
      button.onclick = () => this.choose(value);
      this.controls.push(button);
    });
  }

  choose(value) {
    if (!this.whole) return;
    if (TEST.kind === "intelligibility") this.word = value; else this.choice = value;
    this.controls.forEach(b => b.setAttribute("aria-checked", String(b.dataset.value === value)));
    this.refresh();
  }

  typed() {
    const input = element("input", $("answer"), undefined, {type: "text", maxlength: "60", autocomplete: "off", autocapitalize: "off", spellcheck: "false", "aria-label": TEST.question});
    input.oninput = () => { this.word = input.value.trim() || null; this.refresh(); };
    this.controls.push(input);
  }

  slider(k, name) {
    const box = element("div", $("answer"), undefined, {class: "scale"});
    const label = element("label", box, name, {for: `scale${k}`});
    label.hidden = !name;
    const input = element("input", box, undefined, {type: "range", min: "0", max: "100", step: "0.5", value: "50", id: `scale${k}`, class: "untouched", "aria-label": name || TEST.question});
    const moved = () => { this.scores[k] = Number(input.value); input.classList.remove("untouched"); this.refresh(); };
    input.oninput = moved;
    input.onclick = moved;
    const words = element("div", box);
    TEST.labels.forEach(text => element("span", words, text));
    this.controls.push(input);
  }

  get left() { return TEST.replays ? TEST.replays + 1 - this.times : Infinity; }

  get complete() {
    if (!this.whole) return false;
    if (scored) return this.videos.every((_, k) => this.scores[k] !== undefined);
    return TEST.kind === "intelligibility" ? this.word !== null : this.choice !== null;
  }

  refresh() {
    this.controls.forEach(control => { control.disabled = !this.whole; });
    $("play").disabled = this.busy || this.left <= 0;
    $("play").textContent = this.whole ? "Play again" : "Play";
    $("playA").disabled = $("playB").disabled = this.busy || !this.whole || this.left <= 0;
    $("next").disabled = !this.complete || this.busy;
  }

  // Play both in step, one after the other, or one of them.
  async play(only = null) {
    if (this.busy || this.left <= 0) return;
    this.busy = true;
    this.times += 1;
    $("said").textContent = "";
    this.refresh();
    try {
      const rate = stimulus.get(this.trial.stimuli[0]).rate;
      if (TEST.kind === "dscqs") {
        for (const k of only === null ? [0, 1] : [only]) {
          this.figures.forEach((figure, j) => figure.classList.toggle("waiting", j !== k));
          await together([this.videos[k]], rate);
          this.heard.add(k);
          if (only === null && k === 0) await new Promise(resolve => setTimeout(resolve, 600));
        }
        this.figures.forEach(figure => figure.classList.remove("waiting"));
      } else {
        const late = await together(this.videos, rate);
        if (late !== null) this.apart = Math.round(100 * late) / 100;
        this.videos.forEach((_, k) => this.heard.add(k));
      }
      this.whole = this.heard.size === this.videos.length;
    } catch (error) {
      this.times -= 1;
      $("said").textContent = error.message;
    }
    this.busy = false;
    this.refresh();
  }

  key(name) {
    if (name === " ") this.play();
    else if (name === "Enter") { if (!$("next").disabled) this.next(); }
    else if (TEST.kind === "preference" && ["ArrowLeft", "ArrowRight", "ArrowDown"].includes(name)) {
      const value = {ArrowLeft: "left", ArrowRight: "right", ArrowDown: "tie"}[name];
      if (value !== "tie" || TEST.tie) this.choose(value);
    } else if (/^[1-9]$/.test(name) && this.controls[name - 1]?.dataset.value) this.choose(this.controls[name - 1].dataset.value);
    else return false;
    return true;
  }

  next() {
    this.videos.forEach(v => v.pause());
    this.trial.stimuli.forEach(id => loaded.delete(id));
    const seen = this.trial.stimuli.map(id => ({id, seed: stimulus.get(id).seed, version: stimulus.get(id).version}));
    const seconds = Math.round(performance.now() - this.started) / 1000;
    const row = {trial: this.number, stimuli: seen, plays: this.times, seconds};
    if (this.apart !== null && TEST.kind === "preference") row.apart = this.apart;
    if (scored) row.scores = this.scores; else if (TEST.kind === "intelligibility") row.word = this.word; else row.choice = this.choice;
    this.done(row);
  }
}
