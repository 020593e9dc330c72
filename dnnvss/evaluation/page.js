const DATA = JSON.parse(document.getElementById('data').textContent);
const ink = () => getComputedStyle(document.documentElement).getPropertyValue('--ink').trim();
function draw(canvas, points, contours, box) {
  const c = canvas.getContext('2d'), s = canvas.width / (box[2] - box[0]);
  c.clearRect(0, 0, canvas.width, canvas.height);
  const at = i => [(points[2 * i] - box[0]) * s, (points[2 * i + 1] - box[1]) * s];
  c.lineJoin = 'round'; c.lineWidth = 2 * canvas.width / 300; c.strokeStyle = ink();
  for (const contour of contours) {
    c.beginPath();
    contour.rows.forEach((i, n) => n ? c.lineTo(...at(i)) : c.moveTo(...at(i)));
    if (contour.closed) { c.closePath(); c.fillStyle = contour.fill; if (contour.fill) c.fill('evenodd'); }
    c.stroke();
  }
}
document.querySelectorAll('.sentence').forEach((section, n) => {
  const d = DATA[n], slider = section.querySelector('input'), button = section.querySelector('button');
  const out = section.querySelector('output'), marks = section.querySelectorAll('.cursor');
  const canvases = [...section.querySelectorAll('canvas')], videos = [...section.querySelectorAll('video')];
  let playing = false, last = 0, time = 0;
  const length = d.frames / d.rate;
  function show() {
    const frame = Math.min(d.frames - 1, Math.floor(time * d.rate));
    canvases.forEach((canvas, k) => draw(canvas, d.faces[k][frame], d.contours, d.box));
    slider.value = 1000 * time / length; out.textContent = time.toFixed(2) + ' s';
    marks.forEach(m => { const x = d.left + (d.right - d.left) * time / length; m.setAttribute('x1', x); m.setAttribute('x2', x); });
  }
  function step(now) {
    if (!playing) return;
    time += Math.max(0, now - last) / 1000; last = now;  // a frame's time may lie before the click
    if (time >= length) { time = 0; toggle(); }
    show(); requestAnimationFrame(step);
  }
  function toggle() {
    playing = !playing; button.textContent = playing ? 'Pause' : 'Play';
    videos.forEach(v => { if (playing) { v.currentTime = time; v.play(); } else v.pause(); });
    if (playing) { last = performance.now(); requestAnimationFrame(step); }
  }
  button.onclick = toggle;
  slider.oninput = () => { time = slider.value / 1000 * length; videos.forEach(v => v.currentTime = time); show(); };
  show();
});
