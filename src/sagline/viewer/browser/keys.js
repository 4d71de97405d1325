// Keys that move the platform while the scene has the focus; "?" opens a list of all keys.
(() => {
  const WAYS = {
    ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1], PageUp: [2, 1], PageDown: [2, -1],
  };
  const SIZES = [0.1, 0.2, 0.5, 1, 2, 5, 10];
  const TURNS_CAMERA = new Set(["ArrowRight", "ArrowLeft", "ArrowUp", "ArrowDown"]);
  const HELP = "Arrow keys move the platform along x and y, Page Up and Page Down along z; with Shift they turn it. "
    + "Plus and minus change the step, Home moves the platform home. Press question mark for all keys.";
  const list = [
    ["On the robot (press Tab until it has the focus)"],
    ["← →", "move along x; with Shift turn about z"],
    ["↑ ↓", "move along y; with Shift turn about x"],
    ["Page Up, Page Down", "move along z; with Shift turn about y"],
    ["+ −", "larger and smaller steps"],
    ["Home", "move the platform home"],
    ["On the page"],
    ["Tab, Shift Tab", "next control, previous control"],
    ["← → on a slider", "change its value; Home and End: the ends"],
    ["W A S D, Q E", "move the camera, outside of text fields"],
    ["arrow keys, off the robot", "turn the camera"],
    ["Ctrl Z, Ctrl Y", "undo, redo"],
    ["?", "this list"],
  ];
  let size = 3;
  let scene = { what: "", step: 0, turn: 0 };
  let steps = [0, 0, 0, 0, 0, 0];
  let due = false;

  const typing = ({ tagName, isContentEditable }) => /INPUT|TEXTAREA|SELECT/.test(tagName) || isContentEditable;
  // In a field whose text was changed, the keys of undo belong to the field.
  let edited = null;
  document.addEventListener("input", (event) => {
    edited = event.isTrusted ? event.target : null;
  });
  document.addEventListener("focusout", () => {
    edited = null;
  });
  const onHistory = (event) => {
    const key = event.key.toLowerCase();
    if (!(event.ctrlKey || event.metaKey) || event.altKey || !["z", "y"].includes(key)) return false;
    if (edited && edited === event.target && edited.type !== "range") return false;
    window.sagline.send("history", key === "z" && !event.shiftKey ? "undo" : "redo");
    return true;
  };
  const send = () => {
    due = false;
    window.sagline.send("nudge", steps.map((count) => count * SIZES[size]));
    steps = [0, 0, 0, 0, 0, 0];
  };
  const move = ([axis, sign], turn) => {
    steps[turn ? [3, 5, 4][axis] : axis] += sign; // horizontal keys turn about z, vertical ones about x
    if (!due) requestAnimationFrame(send);
    due = true;
    window.sagline.keyed();
  };
  const resize = (by) => {
    size = Math.min(Math.max(size + by, 0), SIZES.length - 1);
    const round = (value) => Number((value * SIZES[size]).toPrecision(3));
    window.sagline.say(`Steps of ${round(scene.step)} m and ${round(scene.turn)} degrees`);
  };
  const onScene = (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return false;
    if (WAYS[event.key]) move(WAYS[event.key], event.shiftKey);
    else if (event.key === "+" || event.key === "=") resize(1);
    else if (event.key === "-" || event.key === "_") resize(-1);
    else if (event.key === "Home") {
      window.sagline.keyed();
      window.sagline.send("home", 0);
    } else return false;
    return true;
  };
  const help = () =>
    window.sagline.dialog("keys", "Keys", (body) => {
      const table = document.createElement("dl");
      for (const [keys, words] of list) {
        const row = document.createElement("div");
        row.innerHTML = words === undefined ? "<dt class='head'></dt>" : "<dt></dt><dd></dd>";
        row.firstChild.textContent = keys;
        if (words !== undefined) row.lastChild.textContent = words;
        table.append(row);
      }
      body.append(table);
    });
  // Add keys of other parts of the page to the list.
  window.sagline.key = (keys, words) => list.splice(-1, 0, [keys, words]);

  // Registered before viser's client, whose camera also listens on the document.
  document.addEventListener("keydown", (event) => {
    if (onHistory(event)) event.preventDefault();
    else if (event.target.matches?.("canvas[data-engine]") && onScene(event)) {
      event.preventDefault();
      event.stopImmediatePropagation();
    } else if (event.key === "Enter" && edited) edited = null;
    else if (event.key === "?" && !typing(event.target)) {
      event.preventDefault();
      help();
    } else if (TURNS_CAMERA.has(event.key) && event.target.closest?.("[role], button, summary, dialog, input")) {
      event.stopImmediatePropagation(); // the key belongs to a slider or a tab
    }
  });
  document.addEventListener("click", ({ target }) => {
    if (target.closest?.("[data-keys]")) help();
  });
  window.sagline.on("scene", (description) => {
    scene = description;
  });
  window.sagline.on("nudge-reply", (refused) => {
    if (refused) window.sagline.say(refused);
  });
  window.sagline.dress(() => {
    const canvas = document.querySelector("canvas[data-engine]");
    if (!canvas) return;
    if (!document.getElementById("sagline-scene-help")) {
      const help = document.createElement("div");
      help.id = "sagline-scene-help";
      help.className = "sagline-unseen";
      help.textContent = HELP;
      document.body.append(help);
    }
    const attributes = { tabindex: "0", role: "application", "aria-label": scene.what || "Robot",
      "aria-roledescription": "robot", "aria-describedby": "sagline-scene-now sagline-scene-help" };
    for (const [name, value] of Object.entries(attributes)) {
      if (canvas.getAttribute(name) !== value) canvas.setAttribute(name, value);
    }
  });
})();
