// The page: what is asked for stands in the form and the keys; every answer is a take, and the last one is shown.

import {bytes, get, post, send} from '/api.js';
import {Pictures, Player} from '/player.js';
import {Timeline} from '/timeline.js';

const $ = id => document.getElementById(id);
const DIALS = {articulation: value => `${value.toFixed(2)} × the talker's`, speed: value => `${value.toFixed(2)} × the talker's`, anticipation: value => `${value} ms`, life: value => value ? `${value.toFixed(2)} × the talker's` : 'still'};
const SWITCHES = ['closures', 'contacts', 'rest'];
const FIELDS = ['text', ...Object.keys(DIALS), 'seed', 'style', ...SWITCHES];
const milli = seconds => Number(seconds.toFixed(3));
const RESTING = 250;  // milliseconds without a change after which the hand rests
const NEAR = 0.02;  // seconds for which a key holds, before and after it

let speaking = new AbortController();  // of the sentence that is being said; an earlier one is given up

const state = {runs: [], take: null, pictures: null, others: null, against: '', keys: [], words: {}, times: null, sound: null, awaited: false, before: [], held: '', origin: null, changing: false, again: false, pressed: false, moved: 0};

function say(text, bad = false) { $('said').textContent = text; $('said').classList.toggle('bad', bad); }
const guarded = work => (...given) => Promise.resolve(work(...given)).catch(error => { if (error.name !== 'AbortError') say(error.message, true); });

// ---- what is asked for -------------------------------------------------------------------------------------------

function how() {
  const asked = {style: $('style').value, anticipation: Number($('anticipation').value), keys: state.keys.map(({time, name, low}) =>
    ({time: milli(Math.max(0, time - NEAR)), name, low, high: low, end: milli(time + NEAR)}))};
  Object.assign(asked, {life: Number($('life').value), seed: $('seed').validity.valid ? Number($('seed').value) : 0});
  if (asked.style !== 'plain') {
    asked.articulation = Number($('articulation').value);
    for (const name of SWITCHES) asked[name] = $(name).checked;
  }
  return asked;
}

function asked() {
  const run = state.runs.find(each => each.name === $('run').value);
  const body = {run: $('run').value, text: $('text').value.trim(), speed: Number($('speed').value), pronunciations: state.words, ...how()};
  if (state.sound) body.sound = state.sound.id;
  if (state.sound && run && !run.reads) body.text = '';
  if (state.times) body.alignment = state.times;
  return body;
}

// ---- what can be taken back --------------------------------------------------------------------------------------

// What is changed is drawn over what it was when a hand took hold of it.
const hold = () => { state.origin = state.take; return now(); };
const now = () => JSON.stringify({keys: state.keys, words: state.words, times: state.times, sound: state.sound, form: form()});
function remember(then = hold()) { state.before.push(then); if (state.before.length > 100) state.before.shift(); tell(); }

const form = () => Object.fromEntries(FIELDS.map(name => [name, $(name).type === 'checkbox' ? $(name).checked : $(name).value]));

// What a form had; a field of which nothing is known goes back to what it is by itself.
function fill(held) {
  for (const name of FIELDS) {
    const field = $(name), value = held[name];
    if (field.type === 'checkbox') field.checked = value ?? field.defaultChecked; else field.value = value ?? field.defaultValue ?? field.options[0].value;
  }
  tell();
}

const undo = guarded(async () => {
  const last = state.before.pop();
  if (!last) return;
  const {form: held, ...others} = JSON.parse(last);
  Object.assign(state, others);
  fill(held); brought();
  state.held = now();
  await speak(false);
});

// ---- saying it ---------------------------------------------------------------------------------------------------

async function speak(begin = true) {
  if (!$('run').value) return;
  if (!$('text').value.trim() && !state.sound && !state.times) { say('Type what the face is to say, or bring a voice.', true); return; }
  say('Speaking …');
  speaking.abort();
  const begun = performance.now(), {signal} = speaking = new AbortController();
  const take = await post('/v1/speak', asked(), signal);
  await show(take, {begin, begun});
}

// When no button is pressed and nothing was changed for a moment. Until then the worker draws one picture of every
// change and no others, for which the next change would have to wait.
async function atRest() {
  while (state.pressed || performance.now() - state.moved < RESTING) await new Promise(over => setTimeout(over, RESTING / 4));
}
for (const [kind, pressed] of [['pointerdown', true], ['pointerup', false], ['pointercancel', false]]) addEventListener(kind, () => { state.pressed = pressed; }, true);

// One change at a time; what was asked for meanwhile is asked for at the end of it.
const change = guarded(async () => {
  if (!state.take) return;
  state.moved = performance.now();
  if (state.changing) { state.again = true; return; }
  state.changing = true;
  try {
    do {
      state.again = false;
      const begun = performance.now();
      await show(await post(`/v1/takes/${state.take.id}`, how()), {begun, same: true});
    } while (state.again);
  } finally { state.changing = false; }
});

async function show(take, {begin = false, begun = performance.now(), same = false} = {}) {
  const before = state.take, curve = take.curves[$('curve').value] ? $('curve').value : Object.keys(take.curves)[0];
  state.take = take;
  if (!same) { player.pause(); player.time = 0; state.keys = state.keys.filter(key => take.curves[key.name] && key.time < take.seconds); }
  if (before?.curves !== take.curves && !same) options($('curve'), Object.entries(take.curves).map(([name, own]) => [name, own.unit ? `${name} (${own.unit})` : name]), curve);
  timeline.before = same ? state.origin : null;
  timeline.show(take, curve, state.keys, same);
  const heard = same ? null : (take.peaks.length ? bytes(`/v1/takes/${take.id}/sound`) : Promise.resolve(null));
  const pictures = new Pictures(take, $('view').value), from = player.frame(take.frames), first = pictures.fetch(from, 1);
  const [sound] = await Promise.all([heard, first]);
  if (take !== state.take) { pictures.end(); return; }
  if (heard) await player.open(take, sound);
  const face = $('face');
  if (face.width !== take.width || face.height !== take.height) Object.assign(face, {width: take.width, height: take.height});
  state.pictures?.end(); state.pictures = pictures;
  document.body.dataset.first = Math.round(performance.now() - begun);
  say(''); paint(); describe();
  $('play').disabled = $('time').disabled = false;
  if (begin) player.play();
  guarded(async () => {
    if (same) await atRest();
    guarded(beside)();
    await pictures.rest(from, paint);
    if (pictures === state.pictures) document.body.dataset.whole = take.id;
  })();
}

// The other face says the same at the same times; a key of this one is none of the other.
async function beside() {
  const [kind, name] = $('beside').value.split(/:(.*)/s), take = state.take;
  $('second').hidden = !kind;
  if (!kind || !take) { state.others?.end(); Object.assign(state, {others: null, against: ''}); return; }
  const body = {...asked(), alignment: take.alignment, engine: 'none', text: take.text, keys: []};
  const own = state.runs.find(run => run.name === name);
  if (kind === 'style') { body.style = name; for (const dial of ['articulation', ...SWITCHES]) delete body[dial]; } else body.run = name;
  if (!(own ? own.listens : body.sound)) delete body.sound;
  const view = $('view').value, against = JSON.stringify([view, body]);
  if (against === state.against) return;
  state.against = against;
  const other = await post('/v1/speak', body).catch(error => { state.against = ''; throw error; });
  if (against !== state.against) return;
  state.others?.end();
  const pictures = state.others = new Pictures(other, view);
  $('other').width = other.width; $('other').height = other.height;
  $('other-told').textContent = kind === 'style' ? `style ${name}` : name;
  await pictures.rest(player.frame(other.frames), paint);
}

// ---- what is seen ------------------------------------------------------------------------------------------------

function paint() {
  for (const [canvas, pictures] of [[$('face'), state.pictures], [$('other'), state.others]]) {
    const picture = pictures?.held.length ? pictures.at(player.frame(pictures.take.frames)) : null;
    if (picture) canvas.getContext('2d').drawImage(picture, 0, 0, canvas.width, canvas.height);
  }
  $('time').value = player.seconds ? player.time / player.seconds : 0;
  $('clock').textContent = `${player.time.toFixed(2)} s`;
  $('play').textContent = player.playing ? 'Pause' : 'Play';
  timeline.time = player.time; timeline.draw(); here();
}

function here() {
  const take = state.take;
  if (!take) return;
  const parts = [];
  for (const tier of ['words', 'phones']) {
    const own = (take.tiers[tier] || []).find(([start, end]) => player.time >= start && player.time < end);
    if (own && own[2]) parts.push(`${tier === 'words' ? 'word' : 'phone'} ${own[2]}`);
  }
  const curve = take.curves[$('curve').value];
  if (curve) parts.push(`${$('curve').value} ${curve.values[Math.min(take.frames - 1, Math.floor(player.time * take.rate))]?.toFixed(2)} ${curve.unit}`);
  const risks = take.risks.filter(span => player.time >= span.start && player.time <= span.end).flatMap(span => span.risks.map(risk => risk.kind));
  if (risks.length) parts.push(`doubtful: ${[...new Set(risks)].join(', ')}`);
  $('here').textContent = parts.join(' · ');
}

function tell() {
  for (const [name, words] of Object.entries(DIALS)) $(`${name}-told`).textContent = words(Number($(name).value));
  const plain = $('style').value === 'plain';
  for (const name of ['articulation', ...SWITCHES]) $(name).disabled = plain;
  $('undo').disabled = !state.before.length;
  $('clear').disabled = !state.keys.length;
}

function options(select, pairs, chosen) {
  select.replaceChildren(...pairs.map(([value, text]) => new Option(text, value, false, value === chosen)));
}

function describe() {
  const take = state.take;
  $('about').hidden = false;
  $('face-told').textContent = take.run;
  $('command').textContent = take.command;
  $('files').replaceChildren(...take.files.map(name => {
    const item = document.createElement('li'), link = document.createElement('a');
    link.href = `/v1/takes/${take.id}/files/${name}`; link.download = name; link.textContent = name;
    if (take.commands[name]) link.title = take.commands[name];
    item.append(link);
    return item;
  }));
  $('remarks').replaceChildren(...take.remarks.filter(Boolean).map(text => Object.assign(document.createElement('li'), {textContent: text})));
  pronounced(take.pronunciation);
  tell();
}

// The phones of each word; the fields stay as long as they say the same, and with them who stands in one.
function pronounced(rows) {
  const table = $('words').tBodies[0], said = JSON.stringify(rows);
  if (table.dataset.said === said) return;
  table.dataset.said = said; $('spoken-as').hidden = !rows.length;
  table.replaceChildren(...rows.map(row => {
    const line = document.createElement('tr'), field = document.createElement('input');
    field.type = 'text'; field.value = row.phones; field.setAttribute('aria-label', `Phones of ${row.spoken}`);
    field.addEventListener('change', guarded(async () => { remember(); state.words = {...state.words, [row.spoken]: field.value.trim().toUpperCase()}; state.times = null; await speak(); }));
    for (const content of [row.spoken, field, row.source]) { const cell = document.createElement('td'); cell.append(content); line.append(cell); }
    return line;
  }));
}

// ---- changing it by hand -----------------------------------------------------------------------------------------

const timeline = new Timeline($('timeline'), {
  sought: time => player.seek(time),
  grabbed: () => { player.pause(); remember(); },
  dropped: () => { if (timeline.held?.kind !== 'key' && state.edged) { state.edged = false; guarded(speak)(false); } },
  keyed: (key, time, value) => {
    const fresh = {time: milli(time), name: $('curve').value, low: Number(value.toFixed(3))};
    if (key) Object.assign(key, {low: fresh.low}); else state.keys.push(fresh);
    tell(); timeline.draw(); change();
    return key || fresh;
  },
  edged: (index, time) => {
    const take = state.take, times = structuredClone(state.times || take.alignment), edges = times.phones.edges, start = edges[0];
    const old = edges[index], moved = Number(Math.min(edges[index + 1] - 0.02, Math.max(edges[index - 1] + 0.02, start + time)).toFixed(4));
    for (const tier of Object.values(times)) tier.edges = tier.edges.map(edge => Math.abs(edge - old) < 1e-6 ? moved : edge);
    state.times = times; state.edged = true;
    take.tiers.phones[index - 1][1] = take.tiers.phones[index][0] = moved - start;
    timeline.draw();
  },
});

// The edge between two phones that is nearest to the playhead; 0 where there is none.
function nearestEdge() {
  const starts = (state.take.tiers.phones || []).map(([start]) => start).slice(1);
  return 1 + starts.reduce((best, start, k) => best < 0 || Math.abs(start - player.time) < Math.abs(starts[best] - player.time) ? k : best, -1);
}

$('timeline').addEventListener('keyup', event => { if (event.key === 'Shift' && state.edged) { state.edged = false; guarded(speak)(false); } });
$('timeline').addEventListener('keydown', event => {
  const take = state.take, name = $('curve').value;
  if (!take) return;
  const step = {ArrowLeft: -1, ArrowRight: 1}[event.key], turn = {ArrowUp: 1, ArrowDown: -1}[event.key];
  if (event.key !== ' ') player.pause();
  if (step && event.shiftKey) {
    const edge = nearestEdge();
    if (!edge) return;
    if (!state.edged) remember();
    timeline.asked.edged(edge, take.tiers.phones[edge][0] + 0.01 * step);
  } else if (step) player.seek((player.frame(take.frames) + step + 0.5) / take.rate);
  else if (turn) {
    const near = state.keys.find(key => key.name === name && Math.abs(key.time - player.time) < 0.5 / take.rate);
    const [low, high] = timeline.scale, value = near ? near.low : take.curves[name].values[player.frame(take.frames)];
    if (!near) remember();
    timeline.asked.keyed(near, player.time, value + turn * (high - low) / 40);
  } else if (event.key === 'Delete' || event.key === 'Backspace') {
    remember();
    state.keys = state.keys.filter(key => key.name !== name || Math.abs(key.time - player.time) > 1 / take.rate);
    timeline.keys = state.keys; change();
  } else if (event.key === ' ') $('play').click();
  else return;
  event.preventDefault();
});

// ---- what is brought ---------------------------------------------------------------------------------------------

const SESSION = '.json', TIMES = $('file').accept.toLowerCase().split(',').filter(kind => kind.startsWith('.') && kind !== SESSION);

// Files that come together: a session first, then a voice, then its phone times; it is spoken once.
const bring = guarded(async files => {
  const ends = (name, kinds) => kinds.some(kind => name.toLowerCase().endsWith(kind));
  const order = name => ends(name, [SESSION]) ? 0 : ends(name, TIMES) ? 2 : 1;
  remember();
  for (const file of [...files].sort((a, b) => order(a.name) - order(b.name))) {
    say(`Reading ${file.name} …`);
    await [reopen, hear, follow][order(file.name)](file).catch(error => { throw new Error(`${file.name}: ${error.message}`); });
  }
  brought();
  if (state.awaited) say('The session was spoken to a voice: drop the speech.wav that was taken with it.');
  else if ($('text').value.trim() || state.times || state.runs.find(run => run.name === $('run').value)?.reads === false) await speak();
  else say('Type what is said in it, then press Speak; or choose a run that listens to the voice alone.');
});

async function hear(file) {
  state.sound = {...await send('/v1/sounds', file), name: file.name};
  if (!state.awaited) state.times = null;
  state.awaited = false;
}

async function follow(file) { state.times = await send(`/v1/alignments/${encodeURIComponent(file.name)}`, file); }

async function reopen(file) {
  const {saying} = await file.text().then(JSON.parse).catch(() => ({}));
  if (!saying) throw new Error('is no session of this page');
  for (const name of ['run', 'view']) if (![...$(name).options].some(option => option.value === saying[name])) throw new Error(`the session has the ${name} ${saying[name]}, which is not here`);
  for (const name of ['run', 'view']) $(name).value = saying[name];
  fill(saying);
  Object.assign(state, {words: saying.pronunciations || {}, times: saying.alignment || null, sound: null, awaited: Boolean(saying.sound),
    keys: (saying.keys || []).map(key => ({time: key.end === null ? key.time : (key.time + key.end) / 2, name: key.name, low: key.low}))});
}

function brought() {
  const parts = [state.sound && `voice: ${state.sound.name}, ${state.sound.seconds.toFixed(1)} s`, state.times && 'phone times as given'].filter(Boolean);
  $('brought').replaceChildren(parts.join('; '));
  if (!parts.length) return;
  const button = Object.assign(document.createElement('button'), {type: 'button', textContent: 'Let go'});
  button.addEventListener('click', () => { remember(); state.sound = state.times = null; brought(); });
  $('brought').append(' ', button);
}

let recorder = null;
$('record').addEventListener('click', guarded(async () => {
  if (recorder) { recorder.stop(); return; }
  const stream = await navigator.mediaDevices.getUserMedia({audio: true}).catch(() => { throw new Error('the browser gives no microphone; drop a recording instead'); });
  const parts = [];
  recorder = new MediaRecorder(stream);
  recorder.addEventListener('dataavailable', event => parts.push(event.data));
  recorder.addEventListener('stop', () => {
    stream.getTracks().forEach(track => track.stop()); recorder = null;
    $('record').setAttribute('aria-pressed', 'false'); $('record').textContent = 'Record';
    bring([new File(parts, 'recording.webm')]);
  });
  recorder.start(); $('record').setAttribute('aria-pressed', 'true'); $('record').textContent = 'Stop';
}));

$('open').addEventListener('click', () => $('file').click());
$('file').addEventListener('change', () => { const files = [...$('file').files]; $('file').value = ''; if (files.length) bring(files); });
addEventListener('dragover', event => { event.preventDefault(); document.body.classList.add('over'); });
addEventListener('dragleave', event => { if (!event.relatedTarget) document.body.classList.remove('over'); });
addEventListener('drop', event => { event.preventDefault(); document.body.classList.remove('over'); if (event.dataTransfer.files.length) bring(event.dataTransfer.files); });

// ---- buttons and dials -------------------------------------------------------------------------------------------

const player = new Player(paint);
$('form').addEventListener('submit', event => { event.preventDefault(); player.wake(); if (!state.sound) state.times = null; guarded(speak)(); });
$('text').addEventListener('keydown', event => { if (event.key === 'Enter' && (event.ctrlKey || event.metaKey)) $('form').requestSubmit(); });
$('play').addEventListener('click', guarded(() => player.playing ? player.pause() : player.play()));
$('time').addEventListener('input', () => player.seek(Number($('time').value) * player.seconds));
$('slow').addEventListener('change', () => { const playing = player.playing; player.pause(); player.speed = Number($('slow').value); if (playing) player.play(); });
$('loop').addEventListener('change', () => {
  const words = state.take ? state.take.tiers.words || state.take.tiers.speech || [] : [];
  const own = words.find(([start, end]) => player.time >= start && player.time < end) || words.find(([, , label]) => label);
  player.span = $('loop').checked && own ? [own[0], own[1]] : null;
});
$('undo').addEventListener('click', undo);
$('clear').addEventListener('click', () => { remember(); state.keys = []; timeline.keys = state.keys; change(); tell(); });
$('curve').addEventListener('change', () => { if (state.take) { timeline.before = null; timeline.show(state.take, $('curve').value, state.keys); here(); } });
$('beside').addEventListener('change', guarded(beside));
$('view').addEventListener('change', guarded(async () => { if (state.take) await show(state.take, {same: true}); }));
$('run').addEventListener('change', guarded(async () => { state.keys = []; state.before = []; tell(); if (state.take) await speak(false); }));
for (const name of FIELDS.slice(1)) {
  for (const kind of ['pointerdown', 'focus']) $(name).addEventListener(kind, () => { state.held = hold(); });
  $(name).addEventListener('input', () => { tell(); if (name !== 'speed') change(); });
  $(name).addEventListener('change', guarded(async () => {
    remember(state.held); state.held = now();
    if (name === 'speed' && state.take) { if (!state.sound) state.times = null; await speak(false); }
  }));
}
addEventListener('keydown', event => { if ((event.ctrlKey || event.metaKey) && event.key === 'z' && event.target !== $('text')) { event.preventDefault(); undo(); } });

// ---- the runs, and the first one where there is none ---------------------------------------------------------------

async function load() {
  const found = await get('/v1/runs');
  state.runs = found.runs;
  options($('run'), found.runs.map(run => [run.name, `${run.name} (${run.correlation?.toFixed(3) ?? '–'})`]), $('run').value || found.runs[0]?.name);
  options($('style'), found.styles.map(name => [name, name]), $('style').value || found.styles[0]);
  options($('beside'), [['', 'nothing'], ...found.styles.map(name => [`style:${name}`, `style ${name}`]), ...found.runs.map(run => [`run:${run.name}`, run.name])], '');
  $('setup').hidden = found.runs.length > 0; $('whose').hidden = !found.runs.length; $('form').hidden = $('stage').hidden = $('how').hidden = !found.runs.length;
  $('setup-why').textContent = found.why;
  tell();
  if (!found.runs.length) guarded(watch)();
}

async function watch() {
  const {running, failed, step, lines} = await get('/v1/setup');
  $('setup-start').disabled = running; $('setup-lines').hidden = !lines.length;
  $('setup-lines').textContent = lines.join('\n');
  if (failed) say(`it ended with an error: ${lines.at(-1) || step}`, true); else if (running) say(`${step} …`);
  if (running) { setTimeout(guarded(watch), 1000); document.body.dataset.setup = 'running'; } else if (document.body.dataset.setup) { delete document.body.dataset.setup; say(''); if (!failed) await load(); }
}

$('setup-start').addEventListener('click', guarded(async () => { await post('/v1/setup', {}); document.body.dataset.setup = 'running'; await watch(); }));
guarded(load)();
