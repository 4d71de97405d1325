// window.sagline.plotOf: drawing of one track of the timeline, and its values at a time.
(() => {
  const WIDE = 1000; // width of the drawing in its own units
  const HIGH = 100;
  const NEAR = 12; // largest distance of the pointer from a selected line [px]

  const element = (tag, { text, ...attributes } = {}, ...children) => {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (text !== undefined) made.textContent = text; // never HTML, because texts of a log are not checked
    made.append(...children);
    return made;
  };
  const drawn = (tag, attributes) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    return made;
  };
  const fixed = (value, decimals) => {
    const text = value.toFixed(decimals);
    return Number(text) === 0 ? text.replace("-", "") : text;
  };
  // Ticks from low to high at distances of 1, 2 or 5 times a power of ten, about `most` of them.
  const ticksOf = (low, high, most) => {
    const coarse = Math.max(high - low, 1e-12) / most;
    const power = 10 ** Math.floor(Math.log10(coarse));
    const step = [1, 2, 5, 10].map((times) => times * power).find((each) => each >= coarse * (1 - 1e-9));
    const first = Math.ceil(low / step - 1e-9);
    const count = Math.floor(high / step + 1e-9) - first + 1;
    const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    return Array.from({ length: Math.max(count, 0) }, (_, k) => [step * (first + k), fixed(step * (first + k), decimals)]);
  };
  // Index of the last of increasing times that is not after a given time; 0 before the first.
  const indexAt = (times, time) => {
    let low = 0;
    let high = times.length;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    return low;
  };

  // Plot of a track between two times, with values from low to high; `named`: with the name of the track.
  const plotOf = (track, [start, end], [low, high], named) => {
    const x = (time) => (WIDE * (time - start)) / (end - start || 1);
    const y = (value) => (HIGH * (high - value)) / (high - low);
    const svg = drawn("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, preserveAspectRatio: "none", "aria-hidden": "true" });
    const root = element("div", { class: "plot" }, svg);
    const label = (kind, text, place) => {
      root.append(element("span", { class: kind, text, style: place, "aria-hidden": "true" }));
    };

    for (const [from, to] of track.spans) {
      svg.append(drawn("rect", { class: "span", x: x(from), y: 0, width: Math.max(x(to) - x(from), 2), height: HIGH }));
    }
    for (const [value, text, upper] of track.limits) {
      const beyond = upper ? { y: 0, height: y(value) } : { y: y(value), height: HIGH - y(value) };
      svg.append(drawn("rect", { class: "beyond", x: 0, width: WIDE, ...beyond }));
      svg.append(drawn("line", { class: "limit", x1: 0, x2: WIDE, y1: y(value), y2: y(value) }));
      label(`limit ${upper ? "upper" : "lower"}`, text, `top:${y(value)}%`);
    }
    for (const [value, text] of ticksOf(low, high, 4)) {
      svg.append(drawn("line", { class: "grid", x1: 0, x2: WIDE, y1: y(value), y2: y(value) }));
      label("tick", text, `top:${y(value)}%`);
    }
    const lines = track.lines.map(([, color, dashed], k) => {
      const line = drawn("path", { class: "line", d: pathOf(track, k, x, y), stroke: color });
      if (dashed) line.setAttribute("stroke-dasharray", "5 3");
      svg.append(line);
      return line;
    });
    for (const [time, , bad] of track.marks.filter(([when]) => start <= when && when <= end)) {
      root.append(element("i", { class: bad ? "mark bad" : "mark", style: `left:${x(time) / 10}%`, "aria-hidden": "true" }));
    }
    if (named) label("title", track.name, "");
    if (track.far) label("far", track.far, "");

    const valuesAt = (time) => {
      const column = indexAt(track.times, time);
      return track.low.map((line, k) => [line[column], (track.high ?? track.low)[k][column]]);
    };
    return {
      root,
      track,
      // Value of each line at a time as text; a column of many samples has its range.
      valuesAt(time) {
        return valuesAt(time).map(([least, most], k) => {
          const [from, to] = [least, most].map((value) => (value === null ? "–" : fixed(value, track.decimals)));
          const [name, color, dashed] = track.lines[k];
          return { name, color, dashed, text: from === to ? from : `${from} … ${to}` };
        });
      },
      // Index of the line at a height on the screen and a time; -1 if there is none.
      lineAt(time, height) {
        const box = svg.getBoundingClientRect();
        const away = valuesAt(time).map(([least, most]) => {
          if (least === null) return Infinity;
          const [top, bottom] = [most, least].map((value) => box.top + (box.height * y(value)) / HIGH);
          return Math.max(top - height, height - bottom, 0);
        });
        const nearest = Math.min(...away);
        return nearest < NEAR ? away.indexOf(nearest) : -1;
      },
      emphasize(line) {
        lines.forEach((each, k) => each.classList.toggle("near", k === line));
        svg.classList.toggle("pointed", line >= 0);
      },
      ended: (time) => time > track.end,
      why: (time) => track.spans.filter(([from, to]) => from <= time && time <= to).map(([, , why]) => why),
      marksAt: (time, away) => track.marks.filter(([when]) => Math.abs(when - time) <= away),
    };
  };

  const pathOf = (track, k, x, y) => {
    const parts = [];
    let pen = "M";
    track.times.forEach((time, column) => {
      const least = track.low[k][column];
      if (least === null) {
        pen = "M";
        return;
      }
      const most = (track.high ?? track.low)[k][column];
      parts.push(`${pen}${x(time).toFixed(2)} ${y(least).toFixed(2)}`);
      if (most !== least) parts.push(`V${y(most).toFixed(2)}`);
      pen = "L";
    });
    return parts.join("");
  };

  Object.assign(window.sagline, { plotOf, element, fixed, ticksOf });
})();
