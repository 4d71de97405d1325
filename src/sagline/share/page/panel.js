/* What is written beside the picture: verdict, tensions, legend, numbers of the cables. */
"use strict";

const panel = (() => {
  const PAUSE = 400; // ms, that a verdict stands before it is read out
  let telling = 0;
  const NEAR = 20; // px: numbers of cables that stand nearer are written as one

  const written = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits).replace("-", "−") : "–");
  const css = (color) => `rgb(${color.map((each) => Math.round(255 * each)).join(" ")})`;
  const found = (name) => document.querySelector(`[data-part=${name}]`);

  /** Text of an element, only where it changes: who listens hears it once. */
  function say(element, words) {
    if (element.textContent !== words) element.textContent = words;
  }

  function legend(colors) {
    const stops = colors.steps.map((color) => `rgb(${color.join(" ")})`).join(",");
    found("scale").style.background = `linear-gradient(to right, ${stops})`;
    let next = Infinity;
    for (const [share, words] of [...colors.ticks].reverse()) {
      if (next - share < (next > 0.95 ? 0.24 : 0.14)) continue; // no room to write it
      const tick = document.createElement("span");
      tick.textContent = next === Infinity ? `${words} ${colors.unit}` : words;
      tick.style.left = `${100 * share}%`;
      if (share < 0.05 || share > 0.95) tick.className = share < 0.5 ? "first" : "last"; // they end where the scale does
      found("ticks").prepend(tick);
      next = share;
    }
  }

  /** Rows of the table, one a cable; tell(tensions, lengths) writes them. */
  function table(facts) {
    const { colors, machine } = facts, body = found("cables");
    const rows = machine.anchors.map((_, i) => {
      const row = body.insertRow(), name = document.createElement("th");
      name.scope = "row";
      name.innerHTML = `<i></i>${i}`;
      row.append(name, ...[0, 1].map(() => document.createElement("td")));
      return row;
    });
    return (tensions, lengths) => rows.forEach((row, i) => {
      row.firstChild.firstChild.style.background = css(scene.colored(colors, tensions[i]));
      say(row.cells[1], written(tensions[i] / colors.newtons, colors.digits));
      say(row.cells[2], written(lengths[i], 4));
    });
  }

  /** The verdict, seen at once and heard when it stands. */
  function verdict({ good, words }) {
    const box = found("verdict");
    box.className = good === null ? "quiet" : good ? "good" : "bad";
    if (box.textContent === words) return;
    box.textContent = words;
    clearTimeout(telling);
    telling = setTimeout(() => say(found("heard"), words), PAUSE);
  }

  /** Numbers of the cables at their frame anchors; put(view) moves them to where those are seen. */
  function marks(anchors) {
    const layer = found("marks");
    return (view) => {
      const { width, height } = layer.getBoundingClientRect(), groups = [];
      anchors.forEach((anchor, i) => {
        const { x, y } = view.seen(anchor), place = [x * width, y * height];
        const near = groups.find((one) => Math.hypot(one.place[0] - place[0], one.place[1] - place[1]) < NEAR);
        if (near) near.names.push(i);
        else groups.push({ place, names: [i] });
      });
      while (layer.childElementCount < groups.length) layer.append(document.createElement("span"));
      [...layer.children].forEach((mark, k) => {
        mark.hidden = k >= groups.length;
        if (mark.hidden) return;
        const { place: [x, y], names } = groups[k];
        say(mark, names.join(" "));
        mark.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -165%)`;
      });
    };
  }

  return { found, legend, marks, say, table, verdict, written };
})();
