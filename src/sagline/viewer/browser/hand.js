// Clicks on the scene (features/cut.py), and drags of the platform with Ctrl or Cmd (features/push.py).
(() => {
  const SLIP = 4; // largest motion during a click [px]
  const scene = (event) => event.target instanceof HTMLCanvasElement;
  const place = ({ clientX, clientY }, canvas) => {
    const box = canvas.getBoundingClientRect();
    return [(clientX - box.left) / box.width, (clientY - box.top) / box.height];
  };
  const report = (phase, at, keep) => window.sagline.send("pull", { phase, at, keep });

  let pull; // drag with Ctrl: pointer, canvas and position
  let press; // start of a possible click
  let drawn = 0;

  const swallow = (event) => {
    event.stopImmediatePropagation();
    event.preventDefault();
  };
  const end = (phase, keep) => {
    if (!pull) return;
    cancelAnimationFrame(drawn);
    drawn = 0;
    report(phase, pull.at, keep);
    pull = undefined;
  };

  window.addEventListener(
    "pointerdown",
    (event) => {
      press = undefined;
      if (event.button !== 0 || !scene(event)) return;
      const canvas = event.target;
      if (event.ctrlKey || event.metaKey) {
        swallow(event); // the event does not reach gizmo and camera
        end("cancel", false);
        pull = { pointer: event.pointerId, canvas, at: place(event, canvas) };
        report("start", pull.at, false);
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
        if (pull) report("move", pull.at, false);
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
  window.addEventListener("contextmenu", (event) => pull && swallow(event), true); // Ctrl-click on a Mac
  window.addEventListener("pointercancel", () => end("cancel", false));
  window.addEventListener("blur", () => end("cancel", false));
  window.addEventListener("keydown", (event) => event.key === "Escape" && end("cancel", false));
})();
