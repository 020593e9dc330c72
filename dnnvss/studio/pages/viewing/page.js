"use strict";
// The way through a test, from consent to the answers. What was done is kept in the browser, so that a reload goes on.
const KEPT = `viewing-${TEST.id}`;
const STAGES = ["welcome", ...(TEST.questions.length ? ["questions"] : []), ...(TEST.screen ? ["screen"] : []),
  ...(TEST.headphones ? ["headphones"] : []), ...(TEST.practice.length ? ["practice"] : []), "trials", "comment", "end"];
const ROUNDS = 6;
const phone = matchMedia("(pointer: coarse)").matches && Math.min(screen.width, screen.height) < 600;
let trial = null;

const fresh = () => ({viewer: [...crypto.getRandomValues(new Uint8Array(16))].map(b => b.toString(16).padStart(2, "0")).join(""),
  list: null, served: false, stage: "welcome", at: 0, rested: 0, rows: [], questions: [], comment: "", started: Date.now() / 1000,
  ended: null, sent: false, saved: false, device: {width: 0, height: 0, phone, squares: [], tones: null}, right: 0});
let state = fresh();
try {
  const kept = JSON.parse(localStorage.getItem(KEPT));
  if (kept && STAGES.includes(kept.stage)) state = kept;
} catch { /* a browser that keeps nothing begins anew */ }
const keep = () => { try { localStorage.setItem(KEPT, JSON.stringify(state)); } catch { /* then a reload begins anew */ } };

async function post(path, body) {
  const answer = await fetch(path, {method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify(body)});
  const value = await answer.json();
  if (!answer.ok) throw new Error(value.error || answer.statusText);
  return value;
}

// The list of this viewer: from the server, else from the address (?list=3), else drawn.
async function place() {
  if (state.list !== null) return;
  if (location.protocol.startsWith("http")) {
    try {
      const given = await post("place", {viewer: state.viewer});
      if (Number.isInteger(given.list) && TEST.lists[given.list]) {
        state.list = given.list; state.served = true; keep();
        return;
      }
    } catch { /* a host of files alone hands out no lists */ }
  }
  const asked = Number(new URLSearchParams(location.search).get("list") ?? NaN);
  state.list = Number.isInteger(asked) && TEST.lists[asked] ? asked : Math.floor(Math.random() * TEST.lists.length);
  keep();
}

const SECTIONS = ["welcome", "questions", "screen", "headphones", "trial", "rest", "comment", "end"];
const showOnly = name => {
  SECTIONS.forEach(id => { $(id).hidden = id !== name; });
  document.activeElement?.blur();  // a button that is hidden by now would keep Space for itself
  window.scrollTo(0, 0);
};

function go(stage) {
  state.stage = stage; state.at = 0; keep(); show();
}
const onward = () => go(STAGES[STAGES.indexOf(state.stage) + 1]);

function show() {
  trial = null;
  progress();
  const stage = state.stage;
  if (stage === "practice" || stage === "trials") return runTrials();
  showOnly(stage);
  if (stage === "headphones") hearing();
  if (stage === "end") end();
}

function progress() {
  const all = state.list === null ? 0 : TEST.lists[state.list].length, done = state.stage === "trials" ? state.at : state.rows.length;
  $("progress").hidden = !all || STAGES.indexOf(state.stage) < STAGES.indexOf("trials");
  const share = all ? Math.round(100 * done / all) : 0;
  $("progress").setAttribute("aria-valuenow", String(share));
  $("progress").firstElementChild.style.width = `${share}%`;
  $("count").textContent = state.stage === "trials" && done < all ? `${done + 1} of ${all}` : "";
}

function runTrials() {
  const practice = state.stage === "practice", row = practice ? TEST.practice : TEST.lists[state.list];
  if (state.at >= row.length) return onward();
  if (!practice && TEST.rest && state.at && state.at % TEST.rest === 0 && state.rested !== state.at) {
    $("rested").textContent = `${state.at} of ${row.length} are done. Look into the distance for a moment, and continue when you like.`;
    return showOnly("rest");
  }
  showOnly("trial");
  trial = new Trial(row[state.at], practice, answered => {
    if (!practice) state.rows.push(answered);
    state.at += 1; keep(); show();
  });
  const ahead = row[state.at + 1];
  if (ahead !== undefined) TEST.trials[ahead].stimuli.forEach(fetched);
}

// Consent, questions, screen

function welcome() {
  document.title = TEST.title;
  $("title").textContent = $("heading").textContent = TEST.title;
  TEST.instructions.forEach(text => element("p", $("instructions"), text));
  TEST.consent.forEach(text => element("p", $("consent"), text));
  const count = TEST.lists[0].length;
  $("length").textContent = `There are ${count} trials${TEST.practice.length ? ` after ${TEST.practice.length} that do not count` : ""}. If you reload or close the page, it goes on where you were.`;
  if (phone && TEST.phones === "refused") {
    $("refusal").textContent = "This test needs a larger screen than that of a phone. Please open it on a computer or tablet.";
    $("refusal").hidden = false; $("agree").disabled = true;
  }
  $("agree").onclick = async () => {
    $("agree").disabled = true;
    await place();
    if (state.stage !== "welcome") return;
    state.started = Date.now() / 1000;
    Object.assign(state.device, {width: innerWidth, height: innerHeight, phone});
    onward();
  };
  TEST.questions.forEach((asked, k) => {
    const label = element("label", $("asked"), asked.text);
    const input = element(asked.choices.length ? "select" : "input", label, undefined, asked.choices.length ? {} : {type: "text", maxlength: "500"});
    input.id = `question${k}`;
    if (asked.choices.length) ["", ...asked.choices].forEach(text => element("option", input, text || "Please choose", {value: text}));
  });
  $("asked").onsubmit = happened => happened.preventDefault();
  $("answered").onclick = () => {
    const given = TEST.questions.map((_, k) => $(`question${k}`).value.trim());
    if (TEST.questions.some((asked, k) => asked.choices.length && !given[k])) return;
    state.questions = given; onward();
  };
  for (const [k, id] of ["dark", "bright"].entries())
    [0, 1, 2, 3, 4].forEach(n => {
      const button = element("button", $(id), String(n), {role: "radio", "aria-checked": "false"});
      button.onclick = () => {
        state.device.squares[k] = n;
        [...$(id).children].forEach(b => b.setAttribute("aria-checked", String(b === button)));
        $("seen").disabled = state.device.squares[0] === undefined || state.device.squares[1] === undefined;
      };
    });
  $("seen").onclick = onward;
}

// Headphones, after Woods et al. (2017): a tone in antiphase is quiet over loudspeakers and not over headphones.

let hears = null;
function hearing() {
  if (state.at >= ROUNDS) { state.device.tones = state.right; return onward(); }
  const order = [0, 1, 2];  // quiet, in antiphase, plain
  for (const k of [2, 1]) {
    const other = Math.floor(Math.random() * (k + 1));
    [order[k], order[other]] = [order[other], order[k]];
  }
  $("round").textContent = `${state.at + 1} of ${ROUNDS}`;
  const buttons = [...$("quietest").children];
  buttons.forEach(b => { b.disabled = true; });
  $("tones").onclick = async () => {
    $("tones").disabled = true;
    await tones(order);
    $("tones").disabled = false;
    buttons.forEach(b => { b.disabled = false; });
  };
  buttons.forEach(b => {
    b.onclick = () => {
      if (order[Number(b.dataset.tone)] === 0) state.right += 1;
      state.at += 1; keep(); show();
    };
  });
}
async function tones(order) {
  hears ??= new AudioContext();
  await hears.resume();
  const rate = hears.sampleRate, sound = hears.createBuffer(2, Math.round(rate * (TONE * 3 + GAP * 2)), rate);
  order.forEach((kind, k) => {
    const first = Math.round(rate * k * (TONE + GAP)), count = Math.round(rate * TONE), size = kind === 0 ? 0.25 : 0.5;
    for (let i = 0; i < count; i++) {
      const ramp = Math.min(1, i / (0.1 * count), (count - i) / (0.1 * count)), value = size * ramp * Math.sin(2 * Math.PI * 200 * i / rate);
      sound.getChannelData(0)[first + i] = value;
      sound.getChannelData(1)[first + i] = kind === 1 ? -value : value;
    }
  });
  const source = hears.createBufferSource();
  source.buffer = sound;
  source.connect(hears.destination);
  const over = new Promise(resolve => { source.onended = resolve; });
  source.start();
  await over;
}
const TONE = 1, GAP = 0.5;  // seconds

// The end: sent to the server, or saved as a file

const answer = () => ({format: 1, test: TEST.id, viewer: state.viewer, list: state.list, started: state.started, ended: state.ended,
  device: state.device, questions: state.questions, comment: state.comment, rows: state.rows});
async function end() {
  state.ended ??= Date.now() / 1000; keep();
  $("save").hidden = false; $("again").hidden = true;
  $("anew").hidden = !state.sent && !state.saved;  // nothing is given up that nobody has
  if (!state.served) { $("sent").textContent = "Please save your answers as a file and send it to whoever asked you."; return; }
  if (!state.sent) {
    $("sent").textContent = "Sending your answers…";
    try { await post("answers", answer()); state.sent = true; keep(); } catch (error) {
      $("sent").textContent = `Your answers could not be sent (${error.message}). They are kept here: send them again, or save them as a file.`;
      $("again").hidden = false;
      return;
    }
  }
  $("save").hidden = true; $("anew").hidden = false;
  $("sent").textContent = "Your answers have been sent. You may close this page.";
}
function save() {
  const link = element("a", null, undefined, {download: `answers-${state.viewer.slice(0, 8)}.json`});
  link.href = URL.createObjectURL(new Blob([JSON.stringify(answer())], {type: "application/json"}));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  state.saved = true; keep();
  $("anew").hidden = false;
}

$("play").onclick = () => trial?.play();
$("playA").onclick = () => trial?.play(0);
$("playB").onclick = () => trial?.play(1);
$("next").onclick = () => trial?.next();
$("rise").onclick = () => { state.rested = state.at; keep(); show(); };
$("finish").onclick = () => { state.comment = $("words").value.trim(); onward(); };
$("save").onclick = save;
$("again").onclick = end;
$("anew").onclick = () => { state = fresh(); keep(); location.reload(); };
addEventListener("keydown", happened => {
  const inside = happened.target.tagName, typing = inside === "TEXTAREA" || (inside === "INPUT" && happened.target.type === "text");
  if (!trial || happened.repeat || happened.ctrlKey || happened.metaKey || happened.altKey) return;
  if (typing && happened.key !== "Enter") return;
  if (inside === "INPUT" && happened.key.startsWith("Arrow")) return;
  if (inside === "BUTTON" && (happened.key === "Enter" || happened.key === " ") && happened.target.id !== "next" && happened.target.id !== "play") return;
  if (trial.key(happened.key)) happened.preventDefault();
});
welcome();
show();
