/* The page: a robot whose platform is dragged, or a run that plays. */
"use strict";

const share = (() => {
  const { found, say, written } = panel;
  const facts = JSON.parse(found("facts").textContent);
  const WHY = {
    chord: "Not possible: an end of a cable is at its anchor or inside its pulley",
    singular: "Not possible: some motion no cable resists",
    rounds: "Not possible: the tensions do not settle",
  };

  /** Why there are no tensions. */
  function reason({ why, blocking, short }) {
    if (why !== "limits") return WHY[why] + (blocking.length ? `: cable ${blocking.join(", ")}` : "");
    const { newtons, unit, digits } = facts.colors;
    const much = short < Infinity ? `short of ${written(short / newtons, digits)} ${unit}` : "no force alone would do";
    return `Not feasible: ${much}; at their limits: cables ${blocking.join(", ")}`;
  }

  /** A robot at a pose, balanced. */
  function balanced(pose) {
    const state = robot.balanced(facts.machine, pose);
    const { lines } = state, none = lines.map(() => NaN);
    return {
      pose, lines,
      there: lines.map(() => true),
      hung: state.hung ?? lines.map(() => null),
      tension: state.tension ?? none,
      length: state.hung?.map(robot.lengthOf) ?? none,
      feasible: state.feasible,
      verdict: { good: state.feasible, words: state.feasible ? "Feasible" : reason(state) },
    };
  }

  /** A sample of a run. */
  function sample(course, k) {
    const row = (name) => course[name].map((column) => column[k]), turned = row("quaternion"), norm = Math.hypot(...turned);
    const pose = { position: row("position"), matrix: robot.rotation(turned.map((each) => each / norm)) };
    const lines = robot.cablesAt(facts.machine, pose), drawn = row("chord_tension");
    const hung = lines.map((line, i) => (drawn[i] > 0 && line.there ? robot.hang(line, drawn[i], facts.machine.gravity) : null));
    const verdict = facts.verdicts[course.verdict[0][k]], length = row("length");
    const there = length.map((each) => verdict.good === false || each > 0); // one that broke has no length
    return { pose, lines, hung, there, tension: row("tension"), length, feasible: verdict.good, verdict };
  }

  /** The platform as it is dragged, for pointers.js: in the plane of the picture, as far as its freedom goes. */
  function handle(view, canvas, pose, moved) {
    const { grip, middle } = facts.picture, ring = found("ring");
    const allowed = facts.machine.freedom.map((row) => row.slice(0, 3)).filter((row) => Math.hypot(...row) > 0);
    /** Where it is seen, and how large: a finger is no needle. */
    function seen() {
      const { width, height } = canvas.getBoundingClientRect(), center = robot.placed(pose(), middle), at = view.seen(center);
      return [at.x * width, at.y * height, Math.max((grip / Math.hypot(...view.shift(center, 0, 1))) * height, 26)];
    }
    return {
      hit(x, y) {
        const [left, top, radius] = seen();
        return Math.hypot(x - left, y - top) < radius;
      },
      mark() {
        const [left, top, radius] = seen();
        ring.style.width = ring.style.height = `${2 * radius}px`;
        ring.style.transform = `translate(${left - radius}px, ${top - radius}px)`;
      },
      by(x, y) {
        const way = view.shift(pose().position, x, y);
        moved(allowed.reduce((sum, row) => sharing.plus(sum, sharing.dot(row, way), row), [0, 0, 0]));
      },
      begin: () => canvas.classList.add("held"),
      end: () => canvas.classList.remove("held"),
    };
  }

  /** Where the platform is, told and asked for by sliders; changed(pose) after each move. */
  function controls(changed) {
    const start = facts.home, pose = { position: [...start.position], turn: 0 };
    const sliders = [...document.querySelectorAll("[data-axis]")];
    const now = () => ({ position: pose.position, matrix: robot.rotation([0, 0, Math.sin(pose.turn / 2), Math.cos(pose.turn / 2)]) });

    function show() {
      for (const slider of sliders) {
        const axis = Number(slider.dataset.axis), value = axis < 3 ? pose.position[axis] : (pose.turn * 180) / Math.PI;
        const words = axis < 3 ? `${written(value, 2)} m` : `${written(value, 0)}°`;
        slider.value = String(value);
        slider.setAttribute("aria-valuetext", words);
        say(slider.nextElementSibling, words);
      }
      changed(now());
    }

    for (const slider of sliders)
      slider.addEventListener("input", () => {
        const axis = Number(slider.dataset.axis), value = Number(slider.value);
        if (axis < 3) pose.position = pose.position.map((each, k) => (k === axis ? value : each));
        else pose.turn = (value * Math.PI) / 180;
        show();
      });
    function home() {
      Object.assign(pose, { position: [...start.position], turn: 0 });
      show();
    }
    const moved = (way) => {
      pose.position = sharing.plus(pose.position, 1, way);
      show();
    };
    return { home, moved, now, show };
  }

  /** Begin; resolves with what a script may ask: moment(), and where the platform goes or the clock stands. */
  async function begin() {
    const canvas = found("scene"), { picture, machine, colors } = facts;
    if (!("DecompressionStream" in window)) {
      found("without").hidden = false;
      return null;
    }
    let moment = null, trace = null, waiting = false, held = null;
    const view = camera.made(() => redraw());
    const stage = await scene.made(canvas, facts, view), tell = panel.table(facts), put = panel.marks(machine.cables);
    panel.legend(colors);
    found("without").hidden = stage !== null;

    function redraw() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        if (moment && stage) stage.draw(moment, trace);
        put(view);
        held?.mark();
      });
    }

    function show(next) {
      moment = next;
      panel.verdict(moment.verdict);
      tell(moment.tension, moment.length);
      redraw();
    }

    function resize() {
      const { width, height } = canvas.getBoundingClientRect(), dots = Math.min(devicePixelRatio, 2.5);
      [canvas.width, canvas.height] = [Math.round(width * dots), Math.round(height * dots)];
      view.resize(width, height);
      redraw();
    }

    function home() {
      view.show(...picture.seen);
      redraw();
    }

    home();
    found("home").addEventListener("click", home);
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => location.reload()); // a phone has taken it in between
    new ResizeObserver(resize).observe(canvas);
    theme.follow(redraw);
    resize();
    if (!facts.states) {
      const platform = controls((pose) => show(balanced(pose)));
      found("home").addEventListener("click", platform.home);
      held = handle(view, canvas, platform.now, platform.moved);
      pointers.listen(canvas, view, held);
      platform.show();
      return { moment: () => moment, moved: platform.moved, view };
    }
    pointers.listen(canvas, view, null);
    const course = await states.unpacked(facts.states, found("states").textContent);
    trace = Array.from(course.time[0], (_, k) => course.position.map((column) => column[k]));
    player.spans(course.time[0], Array.from(course.verdict[0], (each) => facts.verdicts[each].good));
    const clock = player.made(course.time[0], (k) => show(sample(course, k)));
    clock.show();
    return { moment: () => moment, scrub: clock.scrub, course, view };
  }

  return { balanced, facts, ready: begin() };
})();
