// Spoken verdict for screen readers, after it has changed or the numbers have become constant, not at every update.
(() => {
  const SOON = 400; // delay after a change of the verdict [ms]
  const RESTED = 1200; // time without a change of the numbers [ms]
  const APART = 2500; // shortest time between two sentences [ms]
  let present, said, saidAt = 0, timer, urgent = false;
  let keyed = false; // true after a motion by a key, for which the position is spoken too

  const hidden = (id, role) => {
    let element = document.getElementById(id);
    if (!element && document.body) {
      element = document.createElement("div");
      element.id = id;
      element.className = "sagline-unseen";
      if (role) element.setAttribute("role", role);
      document.body.append(element);
    }
    return element;
  };
  const speak = () => {
    timer = undefined;
    const text = keyed ? `${present.place}. ${present.text}` : present.text;
    keyed = urgent = false;
    if (text === said?.whole) return;
    said = { head: present.head, whole: text };
    saidAt = performance.now();
    hidden("sagline-said", "status").textContent = text;
  };
  const later = (wait) => {
    clearTimeout(timer);
    timer = setTimeout(speak, Math.max(wait, saidAt ? saidAt + APART - performance.now() : 0));
  };
  window.sagline.on("spoken", (now) => {
    const changed = now.head !== said?.head;
    present = now;
    hidden("sagline-scene-now").textContent = `${now.place}. ${now.text}.`;
    if (changed && !urgent) later(SOON);
    else if (!changed) later(RESTED);
    urgent = changed;
  });
  window.sagline.say = (text) => {
    hidden("sagline-heard", "status").textContent = text;
  };
  window.sagline.keyed = () => {
    keyed = true;
  };
  window.sagline.dress(() => {
    hidden("sagline-said", "status");
    hidden("sagline-heard", "status");
    hidden("sagline-scene-now");
  });
})();
