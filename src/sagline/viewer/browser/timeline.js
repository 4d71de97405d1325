// The timeline at the bottom of the page (features/timeline.py): tracks with one clock, pointing and scrubbing.
(() => {
  const { element, fixed, ticksOf, plotOf, send, on } = window.sagline;
  const SETTLED = 1000; // time during which the page keeps its own clock time until the server confirms it [ms]
  const ON_MARK = 8; // largest distance of the pointer from a mark [px]

  let data; // data of the played motion; undefined without one
  let clock = { time: 0, playing: false, speed: 1, following: true };
  let plots = [];
  let strip, parts; // elements of the page
  let dragging = false;
  let requested; // last requested time, until the server confirms it
  let spoken = 0; // last update of the text for screen readers [ms]

  const button = (name, attributes, act) => {
    const made = element("button", { type: "button", "aria-label": name, title: name, ...attributes });
    made.addEventListener("click", act);
    return made;
  };
  const choice = (name, act) => {
    const made = element("select", { "aria-label": name, title: name });
    made.addEventListener("change", () => act(made.selectedIndex));
    return made;
  };

  const build = () => {
    parts = {
      play: button("Play", { class: "play" }, () => send("play", !clock.playing)),
      speed: choice("Speed", (k) => send("speed", data.speeds[k])),
      now: element("b"),
      end: element("span", { class: "end quiet" }),
      follow: element("input", { type: "checkbox" }),
      following: element("span"),
      chart: choice("Shown over time", (k) => send("chart", k)),
      keys: element("div", { class: "keys" }),
      whole: button("Show the whole time", { class: "whole" }, () => look(0, data.duration)),
      fold: button("Fold the timeline", { class: "fold", "aria-expanded": "true" }, fold),
      slider: element("div", { class: "slider", role: "slider", tabindex: 0, "aria-label": "Time", "aria-valuemin": 0 }),
      times: element("div", { class: "times", "aria-hidden": "true" }),
      cursor: element("i", { class: "cursor" }),
      hover: element("i", { class: "hover" }),
      tip: element("div", { class: "sagline tip", role: "status", hidden: "" }),
    };
    parts.follow.addEventListener("change", () => send("follow", parts.follow.checked));
    const following = element("label", {}, parts.follow, parts.following);
    const bar = element("div", { class: "bar" });
    bar.append(parts.play, parts.speed, element("span", { class: "now" }, parts.now, parts.end), following, parts.chart, parts.keys, parts.whole, parts.fold);
    parts.field = element("div", { class: "field" }, parts.slider, parts.hover, parts.cursor, parts.times);
    strip = element("section", { id: "sagline-timeline", class: "sagline", "aria-label": "Timeline" }, bar, parts.field);
    strip.append(parts.tip);
    document.body.append(strip);
    listen(parts.slider);
    new ResizeObserver(() => data && label()).observe(parts.slider);
  };
  const fold = () => {
    const folded = strip.classList.toggle("folded");
    parts.fold.setAttribute("aria-expanded", String(!folded));
    parts.fold.title = folded ? "Unfold the timeline" : "Fold the timeline";
    parts.fold.setAttribute("aria-label", parts.fold.title);
  };

  const options = (select, texts, chosen) => {
    if (texts.join() !== [...select.options].map((each) => each.text).join()) {
      select.replaceChildren(...texts.map((text) => element("option", { text })));
    }
    select.selectedIndex = chosen;
  };
  const stroke = (color, dashed) =>
    element("span", { class: "stroke", style: `border-color:${color};border-top-style:${dashed ? "dashed" : "solid"}` });
  const key = (name, color, dashed) => element("span", { class: "key" }, stroke(color, dashed), ` ${name}`);

  const showTracks = (message) => {
    if (!strip) build();
    data = message ?? undefined;
    strip.hidden = !data;
    if (!data) return;
    plots = data.tracks.map((track) => plotOf(track, data.window, data.range, data.tracks.length > 1));
    parts.slider.replaceChildren(...plots.map((plot) => plot.root));
    parts.slider.style.setProperty("--plots", plots.length);
    parts.slider.setAttribute("aria-valuemax", data.duration);
    parts.following.textContent = `Follow the ${data.kind}`;
    options(parts.chart, data.charts, data.chart);
    options(parts.speed, data.speeds.map((speed) => `${speed === 0.25 ? "¼" : speed} ×`), 0);
    const [first] = data.tracks;
    const groups = [[first.cables ? "cable" : "along", first.lines], ["path", first.paths]];
    parts.keys.replaceChildren(
      ...groups.flatMap(([what, lines]) => [element("span", { class: "quiet", text: `${what} ` }), ...lines.map((line) => key(...line))]),
    );
    parts.whole.hidden = isWhole();
    nextWindow = undefined;
    label();
    showClock();
  };
  const isWhole = () => data.window[1] - data.window[0] >= data.duration;
  const label = () => {
    const most = Math.max(2, Math.floor(parts.slider.clientWidth / 90));
    const ticks = data.duration ? ticksOf(...data.window, most) : [];
    parts.times.replaceChildren(
      ...ticks.map(([time, text], k) => {
        const place = share(time);
        const words = k === ticks.length - 1 ? `${text} s` : text;
        return element("span", { text: words, style: `left:${place}%;transform:translateX(${-place}%)` });
      }),
    );
  };

  const showClock = () => {
    if (!data) return;
    const { time, playing, speed, following } = clock;
    const name = playing ? "Pause" : "Play";
    if (parts.play.title !== name) {
      parts.play.title = name;
      parts.play.setAttribute("aria-label", name);
    }
    parts.play.classList.toggle("playing", playing);
    parts.speed.selectedIndex = data.speeds.indexOf(speed);
    parts.follow.checked = following;
    strip.classList.toggle("left", !following);
    parts.now.textContent = `${fixed(time, decimals())} s`;
    parts.end.textContent = ` of ${fixed(data.duration, decimals())} s`;
    parts.cursor.style.left = `${share(time)}%`;
    parts.cursor.hidden = time < data.window[0] || time > data.window[1];
    parts.slider.setAttribute("aria-valuenow", time);
    if (!playing || performance.now() - spoken > 1000) {
      spoken = performance.now();
      parts.slider.setAttribute("aria-valuetext", inWords(time));
    }
  };
  const decimals = () => (data.duration < 10 ? 3 : 2);
  const width = () => data.window[1] - data.window[0];
  const share = (time) => (width() ? (100 * (time - data.window[0])) / width() : 0);
  const inWords = (time) => {
    const lines = plots.map((plot) => {
      const { name, title, unit } = plot.track;
      const values = plot.valuesAt(time).map((line) => `${line.name}: ${line.text}`);
      return [`${name}, ${title} [${unit}] ${values.join(", ")}`, ...plot.why(time)].join("; ");
    });
    return [`${fixed(time, decimals())} s`, ...lines, ...happened(time).map(([, text]) => text)].join("; ");
  };
  const happened = (time) => plots.flatMap((plot) => plot.marksAt(time, (width() * ON_MARK) / (parts.slider.clientWidth || 1)));

  // Move to another time: without delay on this page, and on the server with at most one message per frame.
  let soon = 0;
  const scrub = (time) => {
    const round = Number(time.toFixed(Math.min(Math.max(6 - Math.floor(Math.log10(data.duration || 1)), 0), 20))); // exactly 1.2 s
    const there = Math.min(Math.max(round, 0), data.duration);
    requested = { time: there, when: performance.now() };
    clock = { ...clock, time: there, playing: false, following: true };
    showClock();
    soon ||= requestAnimationFrame(() => {
      soon = 0;
      send("scrub", clock.time);
    });
  };

  // Show another range of time, for which the server sends finer columns.
  let nextWindow; // requested window
  let looking = 0;
  const look = (start, end) => {
    const wide = Math.min(Math.max(end - start, 2e-6 * data.duration), data.duration);
    const first = Math.min(Math.max(start, 0), data.duration - wide);
    nextWindow = wide >= data.duration ? [0, data.duration] : [first, first + wide];
    looking ||= requestAnimationFrame(() => {
      looking = 0;
      if (nextWindow) send("window", nextWindow);
    });
  };
  const zoom = (times, about) => {
    const [start, end] = nextWindow ?? data.window;
    look(about - (about - start) * times, about + (end - about) * times);
  };
  const pan = (by) => {
    const [start, end] = nextWindow ?? data.window;
    look(start + by * (end - start), end + by * (end - start));
  };

  // Pointing at a cable.
  let pointed = null; // cable under the pointer
  const timeAt = (event) => {
    const box = parts.slider.getBoundingClientRect();
    return data.window[0] + width() * Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
  };
  const plotAt = (event) =>
    plots.find((plot) => event.clientY < plot.root.getBoundingClientRect().bottom) ?? plots[plots.length - 1];
  const point = (event) => {
    const time = timeAt(event);
    const plot = plotAt(event);
    const line = event.pointerType === "mouse" && !dragging ? plot.lineAt(time, event.clientY) : -1;
    for (const each of plots) each.emphasize(each.track.cables === plot.track.cables ? line : -1);
    pointAt(line >= 0 && plot.track.cables ? line : null);
    parts.hover.style.left = `${share(time)}%`;
    parts.hover.hidden = false;
    tell(time, event, line);
  };
  const pointAt = (cable) => {
    if (cable !== pointed) send("point", cable);
    pointed = cable;
  };
  const unpoint = () => {
    for (const plot of plots) plot.emphasize(-1);
    pointAt(null);
    parts.hover.hidden = parts.tip.hidden = true;
  };
  const tell = (time, event, line) => {
    const rows = plots.map((plot) => {
      const values = plot.valuesAt(time).map((each, k) =>
        element("span", { class: k === line ? "value near" : "value" }, stroke(each.color, each.dashed), ` ${each.name}: `, element("b", { text: each.text })),
      );
      const why = plot.why(time).map((text) => element("div", { class: "bad", text }));
      const { name, title, unit } = plot.track;
      const head = `${name}: ${title} [${unit}]${plot.ended(time) ? ", at its end" : ""}`;
      return element("div", {}, element("div", { class: "quiet", text: head }), element("div", { class: "values" }, ...values), ...why);
    });
    const events = happened(time).map(([when, text, bad]) => element("div", { class: bad ? "bad" : "", text: `${fixed(when, 3)} s: ${text}` }));
    parts.tip.replaceChildren(element("b", { text: `${fixed(time, 3)} s` }), ...rows, ...events.slice(0, 4));
    parts.tip.hidden = false;
    const half = parts.tip.offsetWidth / 2 + 6;
    parts.tip.style.left = `${Math.min(Math.max(event.clientX, half), innerWidth - half)}px`;
    parts.tip.style.bottom = `${innerHeight - strip.getBoundingClientRect().top + 6}px`;
  };

  const KEYS = {
    ArrowRight: (event) => (event.ctrlKey ? toMark(1) : send("step", event.shiftKey ? 10 : 1)),
    ArrowLeft: (event) => (event.ctrlKey ? toMark(-1) : send("step", event.shiftKey ? -10 : -1)),
    PageUp: () => scrub(clock.time + data.duration / 10),
    PageDown: () => scrub(clock.time - data.duration / 10),
    Home: () => scrub(0),
    End: () => scrub(data.duration),
    " ": () => send("play", !clock.playing),
    "+": () => zoom(0.5, clock.time),
    "-": () => zoom(2, clock.time),
    0: () => look(0, data.duration),
  };
  KEYS["="] = KEYS["+"];
  KEYS.ArrowUp = KEYS.ArrowRight;
  KEYS.ArrowDown = KEYS.ArrowLeft;
  const toMark = (way) => {
    const times = plots.flatMap(({ track }) => [...track.marks, ...track.spans].map(([time]) => time));
    const ahead = times.filter((time) => way * (time - clock.time) > 1e-9).sort((a, b) => way * (a - b));
    if (ahead.length) scrub(ahead[0]);
  };
  const listen = (slider) => {
    slider.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      slider.setPointerCapture(event.pointerId);
      dragging = true;
      const top = plotAt(event).root.getBoundingClientRect().top;
      const marks = event.clientY - top < 14 ? happened(timeAt(event)) : [];
      scrub(marks.length ? marks[0][0] : timeAt(event)); // the exact time of a mark
      point(event);
    });
    slider.addEventListener("pointermove", (event) => {
      if (dragging) scrub(timeAt(event));
      point(event);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      slider.addEventListener(end, (event) => {
        dragging = false;
        if (event.pointerType !== "mouse") unpoint();
      });
    }
    slider.addEventListener("pointerleave", unpoint);
    slider.addEventListener("dblclick", () => look(0, data.duration));
    slider.addEventListener("wheel", (event) => {
      event.preventDefault();
      const sideways = event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY);
      if (sideways) pan((event.deltaX || event.deltaY) / 1000);
      else zoom(Math.exp(event.deltaY / 500), timeAt(event));
    }, { passive: false });
    slider.addEventListener("keydown", (event) => {
      const act = event.altKey || event.metaKey ? undefined : KEYS[event.key];
      if (!act) return;
      event.preventDefault();
      event.stopPropagation(); // the camera also reacts to the key
      act(event);
    });
  };

  for (const [keys, words] of [
    ["On the timeline"],
    ["← →", "previous or next sample; with Shift ten samples, with Ctrl to the next event"],
    ["Page Up, Page Down", "forward or back by a tenth of the duration"],
    ["Space", "play, pause"],
    ["+ − 0", "zoom in, zoom out, show all"],
  ]) window.sagline.key(keys, words);

  on("timeline", showTracks);
  on("clock", (state) => {
    const late = requested && state.time !== requested.time && performance.now() - requested.when < SETTLED;
    if (dragging || late) return;
    requested = undefined;
    clock = state;
    showClock();
  });
})();
