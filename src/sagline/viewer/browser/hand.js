// The hand on the scene: a click on it, and what is pulled with Ctrl (or Cmd) held (hand.py).
(() => {
  const SLIP = 4; // px: a click does not move farther
  const scene = (event) => event.target instanceof HTMLCanvasElement;
  const place = ({ clientX, clientY }, canvas) => {
    const box = canvas.getBoundingClientRect();
    return [(clientX - box.left) / box.width, (clientY - box.top) / box.height];
  };
  const say = (phase, at, keep) => window.sagline.send("pull", { phase, at, keep });

  let pull; // what is pulled: pointer, canvas, where it is
  let press; // what may become a click
  let drawn = 0;

  const swallow = (event) => {
    event.stopImmediatePropagation();
    event.preventDefault();
  };
  const end = (phase, keep) => {
    if (!pull) return;
    cancelAnimationFrame(drawn);
    drawn = 0;
    say(phase, pull.at, keep);
    pull = undefined;
  };

  window.addEventListener(
    "pointerdown",
    (event) => {
      press = undefined;
      if (event.button !== 0 || !scene(event)) return;
      const canvas = event.target;
      if (event.ctrlKey || event.metaKey) {
        swallow(event); // neither gizmo nor camera takes it
        end("cancel", false);
        pull = { pointer: event.pointerId, canvas, at: place(event, canvas) };
        say("start", pull.at, false);
      } else if (event.isPrimary) {
        press = { x: event.clientX, y: event.clientY };
      }
    },
    true,
  );
  window.addEventListener(
    "pointermove",
    (event) => {
      if (pull?.pointer !== event.pointerId) return;
      swallow(event);
      pull.at = place(event, pull.canvas);
      drawn ||= requestAnimationFrame(() => {
        drawn = 0;
        if (pull) say("move", pull.at, false);
      });
    },
    true,
  );
  window.addEventListener(
    "pointerup",
    (event) => {
      if (pull?.pointer === event.pointerId) {
        swallow(event);
        pull.at = place(event, pull.canvas);
        end("end", event.shiftKey);
      } else if (press && scene(event)) {
        const slip = Math.hypot(event.clientX - press.x, event.clientY - press.y);
        if (slip <= SLIP) window.sagline.send("pick", place(event, event.target));
      }
      press = undefined;
    },
    true,
  );
  window.addEventListener("contextmenu", (event) => pull && swallow(event), true); // Ctrl and a click on a Mac
  window.addEventListener("pointercancel", () => end("cancel", false));
  window.addEventListener("blur", () => end("cancel", false));
  window.addEventListener("keydown", (event) => event.key === "Escape" && end("cancel", false));
})();
