// A run while it learns: curves by epoch and a sample sentence every few epochs, asked for again while it runs.

import {get} from '/api.js';

const AGAIN = 2000;  // milliseconds until a running fit is asked again
const HEIGHT = 260, LEFT = 56, RIGHT = 16, TOP = 14, BOTTOM = 30;
const LINES = [['var(--accent)', ''], ['var(--warn)', '7 4'], ['var(--good)', '2 4'], ['var(--bad)', '10 3 2 3'], ['var(--truth)', '1 3']];
const made = (name, text = '', about = {}) => Object.assign(document.createElement(name), {textContent: text, ...about});
const drawn = (name, attributes, text = '') => {
  const own = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) own.setAttribute(key, value);
  own.textContent = text;
  return own;
};
const short = value => Math.abs(value) >= 100 ? value.toFixed(0) : value.toPrecision(3);

// Drawn as wide as there is room, so that its letters keep their size.
function chart(curves, width) {
  const points = Object.values(curves).flat(), svg = drawn('svg', {viewBox: `0 0 ${width} ${HEIGHT}`, width, height: HEIGHT, class: 'chart', role: 'img', 'aria-label': told(curves)});
  const far = Math.max(1, ...points.map(([epoch]) => epoch)), values = points.map(([, value]) => value);
  const low = Math.min(...values), high = Math.max(...values), span = high - low || 1;
  const x = epoch => LEFT + (width - LEFT - RIGHT) * epoch / far, y = value => TOP + (HEIGHT - TOP - BOTTOM) * (high - value) / span;
  for (const k of [0, 0.5, 1]) {
    const value = low + k * span;
    svg.append(drawn('line', {class: 'axis', x1: LEFT, x2: width - RIGHT, y1: y(value), y2: y(value)}), drawn('text', {x: LEFT - 6, y: y(value) + 4, 'text-anchor': 'end'}, short(value)));
    const epoch = Math.round(k * far);
    svg.append(drawn('text', {x: x(epoch), y: HEIGHT - 8, 'text-anchor': k === 1 ? 'end' : 'middle'}, k === 1 ? `epoch ${epoch + 1}` : `${epoch + 1}`));
  }
  Object.values(curves).forEach((line, k) => {
    const [stroke, dash] = LINES[k % LINES.length];
    if (line.length === 1) svg.append(drawn('circle', {cx: x(line[0][0]), cy: y(line[0][1]), r: 3.5, fill: stroke}));
    else svg.append(drawn('polyline', {points: line.map(([epoch, value]) => `${x(epoch)},${y(value)}`).join(' '), fill: 'none', stroke, 'stroke-width': 2, 'stroke-dasharray': dash}));
  });
  return svg;
}

const told = curves => Object.entries(curves).map(([name, line]) => `${name} ${short(line.at(-1)[1])} after epoch ${line.at(-1)[0] + 1}`).join('; ');

function keys(curves) {
  const own = made('p', '', {className: 'row'});
  Object.entries(curves).forEach(([name, line], k) => {
    const [stroke, dash] = LINES[k % LINES.length], key = made('span', '', {className: 'key'}), mark = drawn('svg', {viewBox: '0 0 26 10', 'aria-hidden': 'true'});
    mark.append(drawn('line', {x1: 0, x2: 26, y1: 5, y2: 5, stroke, 'stroke-width': 2, 'stroke-dasharray': dash}));
    key.append(mark, `${name} ${short(line.at(-1)[1])}`);
    own.append(key);
  });
  return own;
}

function numbers(curves) {
  const own = made('details'), table = made('table'), head = made('tr'), names = Object.keys(curves), rows = new Map();
  names.forEach((name, k) => curves[name].forEach(([epoch, value]) => rows.set(epoch, Object.assign(rows.get(epoch) || [], {[k]: value}))));
  head.append(...['epoch', ...names].map(name => made('th', name)));
  table.append(head);
  for (const [epoch, values] of [...rows].sort(([a], [b]) => a - b).slice(-500)) {
    const row = made('tr');
    row.append(made('td', String(epoch + 1)), ...names.map((_, k) => made('td', values[k] === undefined ? '' : values[k].toPrecision(5))));
    table.append(row);
  }
  const scroll = made('div', '', {className: 'scroll', tabIndex: 0, ariaLabel: 'Numbers of the curves'});
  scroll.setAttribute('role', 'region');
  scroll.append(table);
  own.append(made('summary', 'Numbers'), scroll);
  return own;
}

// The sample sentence: the last picture, and earlier ones by the slider.
function pictures(base, fit, at) {
  if (!fit.pictures.length) return [];
  const own = made('section', '', {className: 'pictures'}), last = fit.pictures.length - 1, k = Math.min(at.chosen ?? last, last);
  const image = made('img'), label = made('label', 'Epoch '), out = made('output'), slider = made('input', '', {type: 'range', min: 0, max: last, value: k});
  const show = () => {
    const epoch = fit.pictures[Number(slider.value)];
    out.textContent = String(epoch + 1);
    image.alt = `A sentence that was not trained on, measured and predicted, after epoch ${epoch + 1}`;
    image.src = `${base}picture?fit=${encodeURIComponent(fit.name)}&step=${epoch}`;
  };
  slider.addEventListener('input', () => { at.chosen = Number(slider.value) === last ? null : Number(slider.value); show(); });
  show();
  label.append(out, ' ', slider);
  const scroll = made('div', '', {className: 'scroll', tabIndex: 0, ariaLabel: 'Sample sentence'});
  scroll.setAttribute('role', 'region');
  scroll.append(image);
  own.append(made('h2', 'A sample sentence, measured and predicted'), label, scroll);
  return [own];
}

function part(base, fit, many, at, epochs, width) {
  const own = made('section');
  own.append(made('h2', many ? fit.name : 'Curves'));
  const done = Math.max(0, ...Object.values(fit.curves).flat().map(([epoch]) => epoch + 1));
  const ago = fit.ago < 90 ? `${Math.round(fit.ago)} s` : fit.ago < 5400 ? `${Math.round(fit.ago / 60)} min` : `${Math.round(fit.ago / 3600)} h`;
  own.append(made('p', `${done}${epochs ? ` of at most ${epochs}` : ''} epochs; it wrote last ${ago} ago`, {className: 'quiet'}));
  if (fit.damaged) own.append(made('p', 'A file of its curves is damaged; what came before is shown.', {className: 'bad'}));
  if (done) own.append(chart(fit.curves, width), keys(fit.curves), numbers(fit.curves));
  own.append(...pictures(base, fit, at));
  return own;
}

// Show a run in an element until the signal says that something else is shown.
export async function showFit(into, base, path, signal) {
  const at = {};
  let before = '';
  while (!signal.aborted) {
    const run = await get(base + path);
    if (signal.aborted) return;
    const now = JSON.stringify([run.state, run.far, run.fits.map(fit => [fit.curves, fit.pictures])]);
    const busy = into.contains(document.activeElement) && document.activeElement !== document.body;
    if (now !== before && !(busy && before && run.state === 'running')) {
      before = now;
      const room = Math.min(900, Math.max(280, into.clientWidth - 32));
      const open = Boolean(into.querySelector('details[open]'));
      const state = made('p', '', {className: 'row'});
      state.append(made('strong', run.state), made('span', run.far));
      into.replaceChildren(state, ...run.fits.map(fit => part(base, fit, run.fits.length > 1, at[fit.name] ??= {}, run.epochs, room)));
      if (!run.fits.length) into.append(made('p', run.state === 'running' ? 'No curves yet: they come with the first epoch.' : 'This system learns without epochs, so that there are no curves.', {className: 'quiet'}));
      into.querySelectorAll('details').forEach(each => { each.open = open; });
    }
    if (run.state !== 'running') return;
    await new Promise(resolve => setTimeout(resolve, AGAIN));
  }
}
