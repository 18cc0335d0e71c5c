"use strict";
// Plays videos only while they are in sight, and not at all by themselves for people who asked for less motion.
(() => {
  const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const videos = document.querySelectorAll("video");
  if (still) { videos.forEach(v => { v.autoplay = false; v.pause(); }); return; }
  if (!("IntersectionObserver" in window)) return;
  const watch = new IntersectionObserver(entries => {
    for (const e of entries) { if (e.isIntersecting) e.target.play().catch(() => {}); else e.target.pause(); }
  }, { threshold: 0.2 });
  videos.forEach(v => watch.observe(v));
})();

// The light desk: light adds up, so a picture in any light is a weighted sum of one picture a light.
// Each layer comes as an 8-bit picture of (radiance / scale)^(1/power).
(() => {
  const desks = document.querySelectorAll(".desk[data-lights]");
  const load = src => new Promise((done, fail) => { const i = new Image(); i.onload = () => done(i); i.onerror = fail; i.src = src; });
  for (const desk of desks) {
    const lights = (window.wovenLights || {})[desk.dataset.lights];
    if (!lights) { desk.hidden = true; continue; }
    const canvas = desk.querySelector("canvas");
    const context = canvas.getContext("2d", { willReadFrequently: true });
    const sliders = [...desk.querySelectorAll("input[type=range]")];
    const show = () => sliders.forEach(s => { s.parentElement.querySelector("output").value = s.dataset.unit === "EV" ? (s.value > 0 ? "+" : "") + s.value + " EV" : s.value + " %"; });
    const weights = preset => { sliders.forEach(s => { s.value = preset[s.name] ?? s.value; }); paint(); };
    let layers = null;
    let waiting = false;
    const paint = () => {
      show();
      if (!layers || waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        const gain = 2 ** (lights.exposure + Number(desk.querySelector("[name=exposure]").value));
        const tables = layers.flatMap(l => {
          const w = gain * Number(desk.querySelector(`[name="${l.name}"]`).value) / 100;
          return l.tint.map(t => Float32Array.from({ length: 256 }, (_, v) => w * t * l.scale * (v / 255) ** l.power));
        });
        const out = context.createImageData(canvas.width, canvas.height), o = out.data;
        const { curve, least, most } = lights, last = curve.length - 1, step = last / (most - least);
        const mixin = lights.mix[0], mixout = lights.mix[1];
        const bend = c => curve[Math.max(0, Math.min(last, Math.round((Math.log2(c + 1e-9) - least) * step)))];
        const code = c => { c = Math.max(0, Math.min(1, c)); return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055); };
        for (let i = 0; i < o.length; i += 4) {
          let r = 0, g = 0, b = 0;
          for (let k = 0; k < layers.length; k++) {
            const d = layers[k].data;
            r += tables[3 * k][d[i]]; g += tables[3 * k + 1][d[i + 1]]; b += tables[3 * k + 2][d[i + 2]];
          }
          let m = 0.2126 * r + 0.7152 * g + 0.0722 * b;
          r = bend(r + (m - r) * mixin); g = bend(g + (m - g) * mixin); b = bend(b + (m - b) * mixin);
          m = 0.2126 * r + 0.7152 * g + 0.0722 * b;
          o[i] = code((r - m * mixout) / (1 - mixout)); o[i + 1] = code((g - m * mixout) / (1 - mixout)); o[i + 2] = code((b - m * mixout) / (1 - mixout)); o[i + 3] = 255;
        }
        context.putImageData(out, 0, 0);
      });
    };
    desk.addEventListener("input", paint);
    desk.querySelectorAll("button[data-preset]").forEach(b => b.addEventListener("click", () => weights(JSON.parse(b.dataset.preset))));
    show();
    Promise.all(lights.layers.map(async l => {
      const image = await load(l.image);
      canvas.width = image.naturalWidth; canvas.height = image.naturalHeight;
      context.drawImage(image, 0, 0);
      return { ...l, data: context.getImageData(0, 0, canvas.width, canvas.height).data };
    })).then(all => { layers = all; paint(); });
  }
})();
