/* Mouse, touch and keys on the picture: around, nearer, aside; and the platform, where it may be dragged. */
"use strict";

const pointers = (() => {
  const TURN = 0.006, STEP = 0.09, WHEEL = 0.0012; // rad a pixel and a key, and of the distance a notch
  const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const middle = ([a, b]) => [(a.clientX + b.clientX) / 2, (a.clientY + b.clientY) / 2];
  const apart = ([a, b]) => Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);

  /** held: how the platform is dragged, { hit(x, y), by(x, y), begin(), end() } with pixels from the top left; or null. */
  function listen(canvas, view, held) {
    const down = new Map();
    let dragged = false;
    const embedded = window.self !== window.top;
    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };

    canvas.addEventListener("pointerdown", (event) => {
      if (down.size >= 2) return;
      canvas.setPointerCapture(event.pointerId);
      if (!down.size) dragged = Boolean(held?.hit(...place(event)));
      else if (dragged) [dragged] = [false, held.end()];
      down.set(event.pointerId, event);
      if (dragged) held.begin();
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = down.get(event.pointerId), { width, height } = canvas.getBoundingClientRect();
      if (!before) {
        if (held && event.pointerType === "mouse") canvas.classList.toggle("over", held.hit(...place(event)));
        return;
      }
      const two = [...down.values()];
      down.set(event.pointerId, event);
      const [x, y] = [event.clientX - before.clientX, event.clientY - before.clientY];
      if (down.size === 2) {
        const now = [...down.values()], [from, to] = [middle(two), middle(now)];
        view.zoom(Math.min(Math.max(apart(two) / Math.max(apart(now), 1), 0.8), 1.25));
        view.pan((to[0] - from[0]) / height, (to[1] - from[1]) / height);
      } else if (dragged) held.by(x / width, y / height);
      else if (event.shiftKey || event.buttons === 4) view.pan(x / height, y / height);
      else view.turn(TURN * x, TURN * y);
    });
    const up = (event) => {
      down.delete(event.pointerId);
      if (dragged) held.end();
      dragged = false;
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("wheel", (event) => {
      if (embedded && !event.ctrlKey) return; // the page around goes on scrolling
      event.preventDefault();
      view.zoom(Math.exp(WHEEL * Math.min(Math.max(event.deltaY, -200), 200)));
    }, { passive: false });
    canvas.addEventListener("touchstart", (event) => {
      const [touch] = event.touches;
      if (!embedded || event.touches.length > 1 || held?.hit(...place(touch))) event.preventDefault();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const way = KEYS[event.key];
      if (way) view.turn(-STEP * way[0], STEP * way[1]);
      else if (event.key === "+" || event.key === "-") view.zoom(event.key === "+" ? 0.9 : 1 / 0.9);
      else return;
      event.preventDefault();
    });
    if (embedded) canvas.style.touchAction = "pan-y"; // a swipe goes past, unless it begins on the platform
  }

  return { listen };
})();
