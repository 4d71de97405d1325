/* The clock of a run: play, pause, speed, scrub. */
"use strict";

const player = (() => {
  /** The last sample at or before a time. */
  function sampleAt(times, time) {
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** Where on the slider a run is not feasible, as a strip below it; good: of each sample. */
  function spans(times, good) {
    const end = times[times.length - 1] || 1, strip = panel.found("spans"), stops = [];
    const bad = good.filter((each) => each === false).length, place = (k) => (100 * times[Math.min(k, times.length - 1)]) / end;
    good.forEach((each, k) => {
      if (each === false && good[k - 1] !== false) stops.push(`transparent ${place(k)}%`);
      if (each === false && good[k + 1] !== false) stops.push(`var(--bad) 0 ${place(k + 1) + 0.2}%, transparent 0`);
    });
    strip.hidden = bad === 0;
    strip.style.background = `linear-gradient(to right, ${stops.join(",")})`;
    strip.setAttribute("aria-label", `Not feasible at ${bad} of ${good.length} samples`);
  }

  /** changed(sample) is called whenever another moment is to be seen. */
  function made(times, changed) {
    const [button, slider, speed, clock] = ["play", "time", "speed", "clock"].map(panel.found);
    const end = times[times.length - 1], digits = end < 100 ? 2 : 1;
    let now = 0, playing = false, last = 0;
    slider.max = String(end);
    slider.step = String(Math.max(end / 1000, 1e-3));

    function show() {
      const words = `${now.toFixed(digits)} s of ${end.toFixed(digits)} s`;
      slider.value = String(now);
      slider.setAttribute("aria-valuetext", words);
      panel.say(clock, words);
      changed(sampleAt(times, now + 1e-9));
    }

    function set(on) {
      if (on && now >= end) now = 0;
      [playing, last] = [on, performance.now()];
      button.setAttribute("aria-label", on ? "Pause" : "Play");
      button.classList.toggle("playing", on);
      if (on) requestAnimationFrame(step);
      show();
    }

    function step(at) {
      if (!playing) return;
      now = Math.min(now + (Math.max(at - last, 0) / 1000) * Number(speed.value), end);
      last = at;
      if (now >= end) set(false);
      else {
        show();
        requestAnimationFrame(step);
      }
    }

    function scrub(time) {
      [playing, now] = [false, Math.min(Math.max(time, 0), end)];
      button.setAttribute("aria-label", "Play");
      button.classList.remove("playing");
      show();
    }

    button.addEventListener("click", () => set(!playing));
    slider.addEventListener("input", () => scrub(Number(slider.value)));
    return { scrub, show };
  }

  return { made, spans };
})();
