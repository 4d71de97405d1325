/* One cable, moved by sliders: docs/explore.md. Both cables are computed by the library's kernels, compiled to
   WebAssembly; tools/pages/explore.py describes their calls. All values are in SI units, except in the texts of the page. */
"use strict";

const cable = (() => {
  const read = (name) => document.querySelector(`script[data-part=${name}]`).textContent;
  const ready = sagline.inflated(read("kernels")).then(sagline.load).then((it) => it.calls(JSON.parse(read("calls"))));
  let of = null;

  /** Cables at chord tensions; given: span, rise, density, stiffness, gravity. */
  function at(model, given, tensions) {
    for (const name of ["span", "rise", "density", "stiffness"]) of[name][0] = given[name];
    of.tension.fill(tensions[0]);
    of.tension.set(tensions);
    of[model]();
    const weight = given.density * given.gravity, chord = Math.hypot(given.span, given.rise);
    return tensions.map((tension, i) => {
      const [length, horizontal, vertical] = [of.length[i], of.horizontal[i], of.vertical[i]];
      const [frameEnd, platformEnd] = [Math.hypot(horizontal, vertical - weight * length), Math.hypot(horizontal, vertical)];
      return { ...given, tension, chord, weight, length, horizontal, vertical, frameEnd, platformEnd, valid: of.status[i] === 0 };
    });
  }

  /** One cable with its largest sag and its points; given: also its tension. */
  function one(model, given) {
    const [found] = at(model, given, [given.tension]);
    of[`${model}Sag`]();
    of[`${model}Points`]();
    const points = Array.from({ length: of.points.length / 2 }, (_, k) => ({ x: of.points[2 * k], z: of.points[2 * k + 1] }));
    return { ...found, sag: of.sag[0], points };
  }

  return {
    ready: ready.then((found) => (of = found)),
    exact: (given) => one("exact", given),
    empirical: (given) => one("empirical", given),
    many: (given, tensions) => at("exact", given, tensions),
  };
})();

/* The page. */
(() => {
  const POINTS = 80;
  const HIGH = 310; // [px], height of both pictures; they are 360 px wide, about as wide as a phone
  const PLACE = { left: 22, top: 88, meter: 23 }; // frame end in the first picture
  const AXES = { left: 46, right: 344, top: 26, bottom: 272 }; // edges of the second picture [px]

  const written = (value, digits = 0) => value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−");
  const path = (points) => points.map(([x, y], i) => `${i ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
  const line = (kind, d) => `<path class="${kind}" d="${d}"/>`;
  const text = (x, y, words, anchor = "start") => `<text x="${x}" y="${y}" text-anchor="${anchor}">${words}</text>`;
  const dot = (kind, [x, y]) => `<circle class="${kind}" cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="4.5"/>`;

  /** Both cables between their ends, to scale. */
  function picture(found, closed) {
    const place = ({ x, z }) => [PLACE.left + PLACE.meter * x, PLACE.top - PLACE.meter * z];
    const drawn = (one) => path(one.points.map(place));
    const [from, to] = [{ x: 0, z: 0 }, { x: found.span, z: found.rise }].map(place);
    const bar = [PLACE.left, HIGH - 18];
    return [
      line("chord", path([from, to])), line("exact", drawn(found)), line("closed", drawn(closed)),
      `<rect class="end" x="${from[0] - 8}" y="${from[1] - 8}" width="16" height="16"/>`, dot("end", to),
      text(from[0] - 8, from[1] - 16, "frame"), text(to[0] + 9, to[1] + 4, "platform"),
      line("chord", path([bar, [bar[0] + 2 * PLACE.meter, bar[1]]])), text(bar[0], bar[1] - 7, "2 m"),
    ].join("");
  }

  /** A step of 1, 2 or 5 times a power of ten that divides a length into about three to six parts. */
  function stepOf(length) {
    const ten = 10 ** Math.floor(Math.log10(length / 3));
    return ten * [5, 2, 1].find((each) => each * ten <= length / 3);
  }

  /** Vertical force on the platform end as a function of the horizontal one: the article's line, and the exact cable. */
  function plane(found, closed) {
    const most = 1.4 * Math.max(found.horizontal, 0.5 * found.weight * found.chord);
    const least = 0.04 * found.weight * found.span; // here half the cable’s weight is about ten chord tensions
    const forces = Array.from({ length: POINTS + 1 }, (_, i) => least * (most / least) ** (i / POINTS));
    const many = cable.many(found, forces.map((force) => (force * found.chord) / found.span));
    const curve = many.map(({ vertical }, i) => [forces[i], vertical]), straight = [[0, closed.vertical - (found.rise / found.span) * found.horizontal]];
    straight.push([most, straight[0][1] + (found.rise / found.span) * most]);
    // the values of the slackest cables are outside the picture
    const heights = [...curve.filter(([force]) => force > 0.6 * found.horizontal), ...straight].map(([, height]) => height);
    const low = Math.min(0, ...heights), high = 1.1 * Math.max(0, ...heights);
    const x = (force) => AXES.left + ((AXES.right - AXES.left) * force) / most;
    const y = (force) => AXES.bottom - ((AXES.bottom - AXES.top) * (force - low)) / (high - low);
    const to = ([across, up]) => [x(across), y(up)];
    const ticks = [];
    const [across, up] = [stepOf(most), stepOf(high - low)];
    for (let force = 0; force <= most; force += across) ticks.push(text(x(force), AXES.bottom + 16, written(force), "middle"));
    for (let k = Math.ceil(low / up - 1e-9); k * up <= high; k++) {
      ticks.push(line("grid", path([[AXES.left, y(k * up)], [AXES.right, y(k * up)]])));
      ticks.push(text(AXES.left - 6, y(k * up) + 4, written(k * up), "end"));
    }
    const room = `x="${AXES.left}" y="${AXES.top}" width="${AXES.right - AXES.left}" height="${AXES.bottom - AXES.top}"`;
    return [
      ...ticks, line("axis", `M${AXES.left} ${AXES.top}V${AXES.bottom}H${AXES.right}`),
      `<clipPath id="explore-plane"><rect ${room}/></clipPath>`,
      `<g clip-path="url(#explore-plane)">${line("exact", path(curve.map(to)))}</g>`,
      line("closed", path(straight.map(to))),
      dot("closed", to([closed.horizontal, closed.vertical])), dot("exact", to([found.horizontal, found.vertical])),
      text(AXES.right, AXES.bottom + 34, "horizontal force, N", "end"),
      text(4, 12, "vertical force, N"),
    ].join("");
  }

  /** Rows of the table: quantity, factor and digits; then unit, factor and digits of the difference. */
  const ROWS = [
    ["length", 1, 4, "mm", 1e3, 1], ["sag", 1e3, 1, "mm", 1e3, 1], ["vertical", 1, 2, "N", 1, 2],
    ["frameEnd", 1, 2, "N", 1, 2], ["platformEnd", 1, 2, "N", 1, 2],
  ];

  function sentence(found, closed) {
    const more = 1e3 * (closed.length - found.length);
    const apart = Math.abs(more) < 0.05 ? "the same within 0.1 mm" : `${written(Math.abs(more), 1)} mm ${more > 0 ? "longer" : "shorter"}`;
    const outside = closed.valid ? "" : " The article’s model is not valid here: the lowest point of the cable is between its ends.";
    return `Exact length ${written(found.length, 3)} m, sag ${written(1e3 * found.sag)} mm; the article’s length is ${apart}.${outside}`;
  }

  function begin(page) {
    const sliders = [...page.querySelectorAll("input[type=range]")];
    const constants = Object.fromEntries(Object.entries(page.dataset).map(([name, value]) => [name, Number(value)]));
    const said = page.querySelector("[role=status]");

    const value = (slider) => {
      const { base, ratio } = slider.dataset, steps = Number(slider.value);
      return ratio ? Number((base * ratio ** steps).toPrecision(3)) : steps;
    };

    function show() {
      const given = { ...constants };
      for (const slider of sliders) {
        const { unit, factor } = slider.dataset, of = value(slider);
        const words = `${slider.dataset.ratio ? of : written(of, 1)} ${unit}`;
        slider.setAttribute("aria-valuetext", words);
        slider.parentElement.querySelector(".value").textContent = words;
        given[slider.name] = of * Number(factor);
      }
      const found = cable.exact(given), closed = cable.empirical(given);
      page.querySelector("[data-picture=cable]").innerHTML = picture(found, closed);
      page.querySelector("[data-picture=plane]").innerHTML = plane(found, closed);
      for (const [name, factor, digits, unit, finer, places] of ROWS) {
        const more = written(finer * (closed[name] - found[name]), places);
        const words = [found, closed].map((one) => written(factor * one[name], digits));
        const cells = page.querySelectorAll(`tr[data-row=${name}] td`);
        [...words, `${/^[−0.]*$|^−/.test(more) ? "" : "+"}${more} ${unit}`].forEach((each, i) => (cells[i].textContent = each));
      }
      page.querySelector("[data-note=range]").hidden = closed.valid;
      return sentence(found, closed);
    }

    const tell = () => (said.textContent = show());
    for (const slider of sliders) {
      slider.addEventListener("input", show);
      slider.addEventListener("change", tell); // after the drag, so that a screen reader announces one sentence
    }
    for (const button of page.querySelectorAll("button")) {
      button.addEventListener("click", () => {
        const asked = JSON.parse(button.dataset.steps);
        for (const slider of sliders) slider.value = asked[slider.name] ?? slider.defaultValue;
        tell();
      });
    }
    page.querySelector("[data-moves]").hidden = false;
    page.querySelector("[data-still]").hidden = true;
    tell();
  }

  cable.ready.then(() => document.querySelectorAll(".explore").forEach(begin));
})();
