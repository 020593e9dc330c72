// Plays takes: pictures come in batches while the first are shown; the sound's clock says which picture is due.

import {bytes} from '/api.js';

const BATCH = 8;  // pictures asked for at a time: a change that comes meanwhile waits for so many at most

// The pictures of a take, fetched a few at a time.
export class Pictures {
  constructor(take, view) {
    this.take = take; this.view = view; this.held = new Array(take.frames).fill(null); this.stop = new AbortController();
  }

  async fetch(first, count) {
    const data = await bytes(`/v1/takes/${this.take.id}/pictures?first=${first}&count=${count}&view=${this.view}`, this.stop.signal);
    const view = new DataView(data), jobs = [];
    for (let at = 0, k = first; at < data.byteLength; k++) {
      const length = view.getUint32(at, true);
      const blob = new Blob([new Uint8Array(data, at + 4, length)], {type: 'image/jpeg'});
      jobs.push(createImageBitmap(blob).then(bitmap => { this.held[k] = bitmap; }));
      at += 4 + length;
    }
    await Promise.all(jobs);
  }

  // Those that are not there yet, from a frame on to the end, then from the start.
  async rest(from, shown) {
    const n = this.take.frames;
    for (let turn = 0; turn < n && !this.stop.signal.aborted; ) {
      const k = (from + turn) % n;
      if (this.held[k]) { turn++; continue; }
      await this.fetch(k, Math.min(BATCH, n - k));
      shown();
    }
  }

  at(frame) {
    for (let k = frame; k >= 0; k--) if (this.held[k]) return this.held[k];
    return null;
  }

  end() { this.stop.abort(); this.held.forEach(bitmap => bitmap && bitmap.close()); this.held = []; }
}

export class Player {
  constructor(changed) {
    this.changed = changed; this.playing = false; this.time = 0; this.speed = 1; this.span = null; this.seconds = 0; this.rate = 25;
    this.buffer = null; this.source = null; this.context = null; this.lag = [];
  }

  wake() {
    this.context ??= new AudioContext();
    return this.context.resume();
  }

  async open(take, sound) {
    this.pause(); this.seconds = take.seconds; this.rate = take.rate;
    this.context ??= new AudioContext();
    this.buffer = sound ? await this.context.decodeAudioData(sound) : null;
  }

  frame(count) { return Math.min(count - 1, Math.max(0, Math.floor(this.time * this.rate + 1e-6))); }

  seek(time) {
    const playing = this.playing;
    this.pause(); this.time = Math.min(Math.max(0, time), Math.max(0, this.seconds - 1e-3));
    if (playing) this.play(); else this.changed();
  }

  async play() {
    await this.wake();
    if (this.time >= this.seconds - 1 / this.rate) this.time = this.span ? this.span[0] : 0;
    if (this.span && (this.time < this.span[0] || this.time >= this.span[1])) this.time = this.span[0];
    this.from = this.time; this.playing = true;
    if (this.buffer && this.time < this.buffer.duration) {
      this.source = this.context.createBufferSource();
      this.source.buffer = this.buffer; this.source.playbackRate.value = this.speed; this.source.connect(this.context.destination);
      this.begun = this.context.currentTime;
      this.source.start(this.begun, this.time);
    } else this.begun = this.context.currentTime;
    this.changed(); requestAnimationFrame(() => this.step());
  }

  pause() {
    if (this.source) { try { this.source.stop(); } catch { /* it has ended */ } this.source.disconnect(); this.source = null; }
    if (this.playing) { this.playing = false; this.changed(); }
  }

  step() {
    if (!this.playing) return;
    const heard = this.context.currentTime - this.begun - (this.context.outputLatency || 0);
    this.time = this.from + Math.max(0, heard) * this.speed;
    const end = this.span ? this.span[1] : this.seconds;
    if (this.time >= end) {
      this.pause(); this.time = this.span ? this.span[0] : this.seconds - 1e-3;
      if (this.span) this.play(); else this.changed();
      return;
    }
    this.changed(); requestAnimationFrame(() => this.step());
  }
}
