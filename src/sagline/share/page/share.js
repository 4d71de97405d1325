/* The page: a robot whose platform is dragged, or a run that plays. */
"use strict";

const share = (() => {
  const { found, say, written } = panel;
  const facts = JSON.parse(found("facts").textContent);
  let machine = null; // its functions, once the kernels are compiled

  /** Why there are no tensions. */
  function refusal({ status, reason, blocking, short }) {
    const { infeasible } = facts.machine, { newtons, unit, digits } = facts.colors;
    if (status !== infeasible) return `Not possible: ${reason}${blocking.length ? `: cable ${blocking.join(", ")}` : ""}`;
    const much = short < Infinity ? `short of ${written(short / newtons, digits)} ${unit}` : "no force alone would do";
    return `Not feasible: ${much}; at their limits: cables ${blocking.join(", ")}`;
  }

  /** A moment for scene and panel: cables with a chord tension hang, the others are straight. */
  function moment(pose, drawn, { there = drawn.map(() => true), tension = drawn, length, verdict }) {
    const courses = machine.courses(pose, drawn), taut = drawn.map((each) => each > 0);
    return { pose, courses, there, taut, tension, length, feasible: verdict.good, verdict };
  }

  /** A robot at a pose, balanced. */
  function balanced(pose) {
    const state = machine.inverse(pose), none = facts.machine.anchors.map(() => NaN);
    const verdict = { good: state.feasible, words: state.feasible ? "Feasible" : refusal(state) };
    return moment(pose, state.tension ?? none, { length: state.length ?? none, verdict });
  }

  /** A planned moment with one cable longer by some meters: where the platform comes to rest. */
  function wound(planned, cable, more) {
    const length = planned.length.map((each, i) => (i === cable ? each + more : each));
    const { solved, reason, position, quaternion, tension } = machine.forward(length, planned.pose);
    if (!position) return moment(planned.pose, length.map(() => NaN), { length, verdict: { good: false, words: `Not held: ${reason}` } });
    const way = 1e3 * Math.hypot(...robot.plus(position, -1, planned.pose.position));
    const words = solved ? `At rest ${written(way, 1)} mm from the planned pose` : `Not held: ${reason}`;
    return moment(robot.posed(position, quaternion), tension, { length, verdict: { good: solved ? null : false, words } });
  }

  /** A robot whose kernels are not compiled yet: straight cables without tensions. */
  function straight() {
    const pose = robot.posed(facts.home.position, [0, 0, 0, 1]), { anchors, ends } = facts.machine, none = anchors.map(() => NaN);
    const courses = anchors.map((anchor, i) => [anchor, robot.placed(pose, ends[i])]), all = anchors.map(() => true);
    return { pose, courses, there: all, taut: all, tension: none, length: none, feasible: true, verdict: { good: null, words: "Loading the model" } };
  }

  /** A sample of a run. */
  function sample(course, k) {
    const row = (name) => course[name].map((column) => column[k]), turned = row("quaternion"), norm = Math.hypot(...turned);
    const pose = robot.posed(row("position"), turned.map((each) => each / norm));
    const verdict = facts.verdicts[course.verdict[0][k]], length = row("length");
    const there = length.map((each) => verdict.good === false || each > 0); // one that broke has no length
    return moment(pose, row("chord_tension"), { there, tension: row("tension"), length, verdict });
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
        moved(allowed.reduce((sum, row) => robot.plus(sum, robot.dot(row, way), row), [0, 0, 0]));
      },
      begin: () => canvas.classList.add("held"),
      end: () => canvas.classList.remove("held"),
    };
  }

  /** Where the platform is, told and asked for by sliders; changed(pose) after each move. */
  function controls(changed) {
    const start = facts.home, pose = { position: [...start.position], turn: 0 };
    const sliders = [...document.querySelectorAll("[data-axis]")];
    const now = () => robot.posed(pose.position, [0, 0, Math.sin(pose.turn / 2), Math.cos(pose.turn / 2)]);

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
      pose.position = robot.plus(pose.position, 1, way);
      show();
    };
    return { home, moved, now, show };
  }

  /** The winch of one cable, by a slider; changed(cable, meters) after each move. Returns the function that resets it. */
  function winch(changed) {
    const cable = found("cable"), slider = found("wind");
    function show() {
      const words = `${written(Number(slider.value), 1)} mm`;
      slider.setAttribute("aria-valuetext", words);
      say(slider.nextElementSibling, words);
    }
    function reset(possible) {
      [slider.value, slider.disabled] = ["0", !possible];
      show();
    }
    const move = () => {
      show();
      changed(Number(cable.value), Number(slider.value) / 1e3);
    };
    slider.addEventListener("input", move);
    cable.addEventListener("change", move);
    return reset;
  }

  /** Begin; resolves with what a script may ask: moment(), and where the platform goes or the clock stands. */
  async function begin() {
    const canvas = found("scene"), { picture, colors } = facts;
    if (!("DecompressionStream" in window)) {
      found("without").hidden = false;
      return null;
    }
    let seen = null, trace = null, waiting = false, held = null;
    const view = camera.made(() => redraw());
    const stage = await scene.made(canvas, facts, view), tell = panel.table(facts), put = panel.marks(facts.machine.anchors);
    panel.legend(colors);
    found("without").hidden = stage !== null;

    function redraw() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        if (seen && stage) stage.draw(seen, trace);
        put(view);
        held?.mark();
      });
    }

    function show(next) {
      seen = next;
      panel.verdict(seen.verdict);
      tell(seen.tension, seen.length);
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
    if (!facts.states) show(straight());
    machine = await (await sagline.load(await sagline.inflated(found("kernels").textContent))).robot(facts.machine);
    if (!facts.states) {
      let planned = null;
      const reset = winch((cable, more) => show(planned.feasible && more ? wound(planned, cable, more) : planned));
      const platform = controls((pose) => {
        show(planned = balanced(pose));
        reset(planned.feasible);
      });
      found("home").addEventListener("click", platform.home);
      held = handle(view, canvas, platform.now, platform.moved);
      pointers.listen(canvas, view, held);
      platform.show();
      return { moment: () => seen, moved: platform.moved, view };
    }
    pointers.listen(canvas, view, null);
    const course = await states.unpacked(facts.states, found("states").textContent);
    trace = Array.from(course.time[0], (_, k) => course.position.map((column) => column[k]));
    player.spans(course.time[0], Array.from(course.verdict[0], (each) => facts.verdicts[each].good));
    const clock = player.made(course.time[0], (k) => show(sample(course, k)));
    clock.show();
    return { moment: () => seen, scrub: clock.scrub, course, view };
  }

  return { balanced, facts, ready: begin() };
})();
