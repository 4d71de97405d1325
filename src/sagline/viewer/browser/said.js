// Spoken verdict for screen readers: when it changes or has settled, not at every update.
(() => {
  const SOON = 400; // ms after a change of the verdict itself
  const RESTED = 1200; // ms without a change of the numbers
  const APART = 2500; // ms between two sentences
  let present, said, saidAt = 0, timer, urgent = false;
  let keyed = false; // moved by a key: the position is spoken too

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
