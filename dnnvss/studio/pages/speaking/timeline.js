// What is said over time: waveform, words, phones, risks, a curve that can be held, and the keys that hold it.

const WAVE = 46, ROW = 22, GAP = 6, PAD = 6, CLICK = 3;  // pixels; a hand that moves no further than CLICK only looks
export const CURVE_TOP = WAVE + 2 * ROW + 3 * GAP;

export class Timeline {
  constructor(canvas, asked) {
    this.canvas = canvas; this.asked = asked; this.take = null; this.curve = null; this.keys = []; this.time = 0; this.before = null;
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
    canvas.addEventListener('pointerdown', event => this.down(event));
    canvas.addEventListener('pointermove', event => this.held && this.moved(event));
    for (const kind of ['pointerup', 'pointercancel']) canvas.addEventListener(kind, () => { if (this.held) { this.held = null; this.asked.dropped(); } });
  }

  get width() { return this.canvas.clientWidth; }
  get height() { return this.canvas.clientHeight; }
  x(time) { return PAD + (this.width - 2 * PAD) * time / this.take.seconds; }
  at(x) { return Math.min(Math.max(0, (x - PAD) / (this.width - 2 * PAD)), 1) * this.take.seconds; }

  range() {
    const values = this.take.curves[this.curve].values;
    let low = Math.min(...values), high = Math.max(...values);
    const room = (high - low || 1) * 0.25;
    return [low - room, high + room];
  }

  y(value) { const [low, high] = this.scale; return this.height - 8 - (this.height - CURVE_TOP - 16) * (value - low) / (high - low); }
  value(y) { const [low, high] = this.scale; return low + (high - low) * (this.height - 8 - y) / (this.height - CURVE_TOP - 16); }

  show(take, curve, keys, keepScale = false) {
    this.take = take; this.curve = curve; this.keys = keys;
    if (!keepScale || !this.scale) this.scale = this.range();
    this.draw();
  }

  place(event) { const box = this.canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; }

  down(event) {
    if (!this.take) return;
    const [x, y] = this.place(event), time = this.at(x);
    this.canvas.setPointerCapture(event.pointerId);
    if (y > CURVE_TOP && this.curve) {
      const near = this.keys.findIndex(key => key.name === this.curve && Math.abs(this.x(key.time) - x) < 9);
      this.held = {kind: 'key', key: near >= 0 ? this.keys[near] : null, from: [x, y]};
    } else {
      const edge = this.edge(x, y);
      this.held = edge ? {kind: 'edge', ...edge} : {kind: 'time'};
      if (edge) this.asked.grabbed();
    }
    if (this.held.kind !== 'edge') this.asked.sought(this.held.key ? this.held.key.time : time);
  }

  moved(event) {
    const [x, y] = this.place(event), time = this.at(x);
    if (this.held.from && Math.hypot(x - this.held.from[0], y - this.held.from[1]) < CLICK) return;
    if (this.held.from) { this.held.time = this.at(this.held.from[0]); this.held.from = null; this.asked.grabbed(); }
    if (this.held.kind === 'time') this.asked.sought(time);
    else if (this.held.kind === 'key') this.held.key = this.asked.keyed(this.held.key, this.held.key ? this.held.key.time : this.held.time, this.value(y));
    else this.asked.edged(this.held.index, time);
  }

  // The edge between two phones under the pointer.
  edge(x, y) {
    const top = WAVE + ROW + 2 * GAP;
    if (y < top || y > top + ROW) return null;
    const phones = this.take.tiers.phones || [];
    const index = phones.findIndex((phone, k) => k > 0 && Math.abs(this.x(phone[0]) - x) < 4);
    return index > 0 ? {index} : null;
  }

  draw() {
    const ratio = devicePixelRatio || 1, c = this.canvas.getContext('2d'), style = getComputedStyle(document.documentElement);
    const colour = name => style.getPropertyValue('--' + name).trim();
    this.canvas.width = this.width * ratio; this.canvas.height = this.height * ratio;
    c.scale(ratio, ratio); c.clearRect(0, 0, this.width, this.height);
    if (!this.take) return;
    c.font = '11px system-ui, sans-serif'; c.textAlign = 'center'; c.textBaseline = 'middle';
    this.wave(c, colour);
    this.tier(c, colour, this.take.tiers.words || this.take.tiers.speech || [], WAVE + GAP);
    this.tier(c, colour, this.take.tiers.phones || [], WAVE + ROW + 2 * GAP);
    this.risks(c, colour);
    if (this.curve) this.track(c, colour);
    c.strokeStyle = colour('ink'); c.lineWidth = 1.2; c.beginPath(); c.moveTo(this.x(this.time), 0); c.lineTo(this.x(this.time), this.height); c.stroke();
  }

  wave(c, colour) {
    const peaks = this.take.peaks, most = Math.max(0.05, ...peaks);
    c.fillStyle = colour('truth');
    peaks.forEach((peak, k) => { const h = (WAVE - 4) * peak / most; c.fillRect(this.x(k / 100), (WAVE - h) / 2, Math.max(1, this.width / peaks.length), Math.max(1, h)); });
  }

  tier(c, colour, segments, top) {
    c.strokeStyle = colour('line'); c.lineWidth = 1;
    for (const [start, end, label] of segments) {
      const a = this.x(start), b = this.x(end);
      c.fillStyle = this.time >= start && this.time < end && label ? colour('line') : colour('paper');
      c.fillRect(a, top, b - a, ROW); c.strokeRect(a, top, b - a, ROW);
      c.fillStyle = colour('ink');
      if (label && c.measureText(label).width < b - a) c.fillText(label, (a + b) / 2, top + ROW / 2);
    }
  }

  risks(c, colour) {
    c.fillStyle = colour('warn');
    const telling = risk => risk.kind !== 'unseen triphone' && risk.kind !== 'unseen neighbours';
    for (const span of this.take.risks) if (span.risks.some(telling)) c.fillRect(this.x(span.start), WAVE + 2 * ROW + 2 * GAP + 1, Math.max(2, this.x(span.end) - this.x(span.start)), 3);
  }

  track(c, colour) {
    const line = (values, stroke, width) => {
      c.strokeStyle = stroke; c.lineWidth = width; c.beginPath();
      values.forEach((value, k) => { const x = this.x((k + 0.5) / this.take.rate), y = this.y(value); k ? c.lineTo(x, y) : c.moveTo(x, y); });
      c.stroke();
    };
    const [low, high] = this.scale;
    c.textAlign = 'left'; c.fillStyle = colour('soft');
    const curve = this.take.curves[this.curve];
    c.fillText(`${this.curve} ${curve.unit ? `(${curve.unit})` : ''} ${high.toFixed(1)}`, PAD, CURVE_TOP + 7); c.fillText(low.toFixed(1), PAD, this.height - 8);
    c.textAlign = 'center';
    if (this.before && this.before.curves[this.curve] && this.before.frames === this.take.frames) line(this.before.curves[this.curve].values, colour('truth'), 1);
    line(curve.values, colour('accent'), 2);
    for (const key of this.keys) {
      if (key.name !== this.curve) continue;
      c.fillStyle = colour('warn'); c.beginPath(); c.arc(this.x(key.time), this.y(key.low), 5, 0, 7); c.fill();
    }
  }
}
