// The dot in the drawing of the feasible tensions (features/tensions.py), moved by mouse, finger and arrow keys.
(() => {
  const STEP = 0.01; // share of the drawing; ten times as far with the shift key
  const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const field = () => document.querySelector("svg[data-dot]");
  const handle = () => document.querySelector("svg[data-dot] .handle");

  let waiting; // message for the next frame
  const soon = (value) => {
    if (waiting === undefined) requestAnimationFrame(now);
    waiting = value;
  };
  const now = () => {
    if (waiting !== undefined) window.sagline.send("dot", waiting);
    waiting = undefined;
  };

  // Coordinates of the null space under a pointer. The drawing is replaced while the dot moves; the coordinates therefore
  // refer to the drawing at the start of the drag.
  let drag;
  const coordinates = (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(drag.inverse);
    const away = [at.x - drag.width / 2, drag.height / 2 - at.y];
    return drag.middle.map((value, axis) => value + away[axis] / drag.scale);
  };
  document.addEventListener("pointerdown", (event) => {
    const svg = event.target.closest?.("svg[data-dot]");
    if (!svg || event.button !== 0 || event.target.closest("[data-send]")) return;
    const { width, height } = svg.viewBox.baseVal;
    drag = {
      pointer: event.pointerId, width, height, scale: Number(svg.dataset.scale),
      middle: svg.dataset.middle.split(" ").map(Number), inverse: svg.getScreenCTM().inverse(),
    };
    soon({ at: coordinates(event) });
    event.preventDefault(); // do not select text
    handle()?.focus({ preventScroll: true });
  });
  document.addEventListener("pointermove", (event) => {
    if (drag?.pointer === event.pointerId) soon({ at: coordinates(event) });
  });
  for (const end of ["pointerup", "pointercancel"]) {
    document.addEventListener(end, (event) => {
      if (drag?.pointer !== event.pointerId) return;
      now();
      drag = undefined;
    });
  }

  document.addEventListener("keydown", (event) => {
    const way = KEYS[event.key];
    if (!way || !event.target.closest?.("svg[data-dot] .handle")) return;
    const far = STEP * (event.shiftKey ? 10 : 1);
    const before = waiting?.by ?? [0, 0];
    soon({ by: way.map((part, axis) => before[axis] + far * part) });
    event.preventDefault();
    event.stopImmediatePropagation(); // the camera also reacts to arrow keys
  }, true);

  // The dot keeps the focus when the drawing is replaced.
  let kept = false;
  document.addEventListener("focusin", (event) => {
    kept = Boolean(event.target.closest?.("svg[data-dot] .handle"));
  });
  document.addEventListener("pointerdown", (event) => {
    kept = kept && Boolean(event.target.closest?.("svg[data-dot]"));
  });
  new MutationObserver(() => {
    if (kept && document.activeElement === document.body) handle()?.focus({ preventScroll: true });
  }).observe(document, { childList: true, subtree: true });
})();
