// Names, roles and keys for unnamed elements of viser, from adjacent labels, icons and figures.
(() => {
  const ICONS = {
    adjustments: "Settings of the page",
    "arrow-back": "Back to the controls",
    "list-search": "Commands",
    share: "Share",
    x: "Close",
  };
  const FIELDS = "input:not([type=hidden]), textarea, [role=slider], [role=spinbutton]";
  const SHEET = '[style*="position: fixed"][style*="width: 20em"]';
  const AXES = { 2: ["x", "y"], 3: ["x", "y", "z"] };

  const set = (element, name, value) => {
    if (element.getAttribute(name) !== value) element.setAttribute(name, value);
  };
  const named = (element) =>
    element.getAttribute("aria-label") || element.hasAttribute("aria-labelledby") || element.labels?.length;
  const icon = (element) =>
    [...element.querySelectorAll("svg.tabler-icon")].flatMap((svg) =>
      [...svg.classList].filter((one) => one.startsWith("tabler-icon-")).map((one) => one.slice("tabler-icon-".length)),
    )[0];

  const fields = () => {
    for (const label of document.querySelectorAll("label[for]")) {
      const row = label.closest(".mantine-Flex-root") ?? label.parentElement.parentElement.parentElement;
      const unnamed = [...row.querySelectorAll(FIELDS)].filter((field) => !named(field) || field.sagline);
      const several = AXES[row.querySelectorAll(".mantine-NumberInput-input").length] ?? [];
      for (const [i, field] of unnamed.entries()) {
        set(field, "aria-label", several[i] ? `${label.textContent}, ${several[i]}` : label.textContent);
        field.sagline = true; // a name from the label, which follows its changes
      }
    }
    for (const field of document.querySelectorAll(FIELDS)) {
      if (!named(field) && field.value?.startsWith("ws")) set(field, "aria-label", "Address of the server");
    }
  };
  const buttons = () => {
    for (const button of document.querySelectorAll("button, [role=button]")) {
      if (button.hasAttribute("aria-label") && !button.sagline) continue;
      if (button.textContent.trim() && !button.sagline) continue;
      const known = icon(button);
      const note = button.closest(".mantine-Notification-root");
      set(button, "aria-label", note ? "Close this note" : (ICONS[known] ?? known?.replaceAll("-", " ") ?? "Close"));
      button.sagline = true;
    }
  };
  // Turn an element that reacts to clicks into a button for the keyboard.
  const press = (element, expanded) => {
    set(element, "role", "button");
    set(element, "tabindex", "0");
    element.dataset.pressed = "";
    if (expanded !== undefined) set(element, "aria-expanded", String(expanded));
  };
  const folders = () => {
    for (const chevron of document.querySelectorAll(
      ".mantine-Paper-root > .mantine-Paper-root > :is(.tabler-icon-chevron-up, .tabler-icon-chevron-down)",
    )) {
      const empty = chevron.style.display === "none";
      if (!empty) press(chevron.parentElement, chevron.classList.contains("tabler-icon-chevron-up"));
    }
    const sheet = document.querySelector(SHEET);
    const head = sheet?.querySelector('[style*="height: 3.5em"] p, [style*="height: 3.5em"] .mantine-Text-root');
    if (head) {
      press(head);
      set(head, "aria-label", `${head.textContent}: open or close the controls`);
    }
    for (const toggle of document.querySelectorAll('[role="button"]:not([tabindex]):not(button)')) press(toggle);
  };
  // The tree of the scene, in the settings of the page: each icon is a button.
  const tree = () => {
    for (const row of document.querySelectorAll("[data-scene-node]")) {
      const name = row.dataset.sceneNode || "the scene";
      for (const svg of row.querySelectorAll("svg")) {
        const caret = svg.matches(".tabler-icon-caret-right, .tabler-icon-caret-down");
        if (caret && svg.parentElement.style.opacity < 0.5) continue; // a node without children
        if (!caret && svg.style.cursor !== "pointer") continue;
        const what = caret ? "Parts of" : svg.matches(".tabler-icon-pencil") ? "Edit" : "Show or hide";
        press(svg, caret ? svg.matches(".tabler-icon-caret-down") : undefined);
        set(svg, "aria-label", `${what} ${name}`);
      }
    }
    for (const image of document.querySelectorAll("img:not([alt])")) image.alt = "";
  };
  const pictures = () => {
    for (const svg of document.querySelectorAll("svg:not([aria-hidden]):not([role])")) {
      if (svg.closest(".sagline")) set(svg, "role", "img");
      else set(svg, "aria-hidden", "true"); // an icon with a label
    }
    for (const svg of document.querySelectorAll(".sagline svg[role=img]:not([aria-label])")) {
      set(svg, "aria-label", svg.querySelector("title, text")?.textContent || "figure");
    }
    for (const canvas of document.querySelectorAll('canvas[style*="pointer-events: none"]')) {
      set(canvas, "aria-hidden", "true"); // overlay of the scene during a selection of a rectangle
    }
  };
  // Folded content has zero height, but keys could still reach it.
  const folded = () => {
    for (const box of document.querySelectorAll('[style*="grid-template-rows"]')) {
      const hidden = /grid-template-rows:\s*0fr/.test(box.getAttribute("style"));
      if (box.inert !== hidden) box.inert = hidden;
    }
  };

  window.sagline.dress(() => {
    fields();
    folders();
    tree();
    buttons();
    pictures();
    folded();
  });
  document.addEventListener("keydown", (event) => {
    if (event.target.dataset?.pressed === undefined || !["Enter", " "].includes(event.key)) return;
    event.preventDefault();
    for (const kind of ["mousedown", "mouseup", "click"]) {
      event.target.dispatchEvent(new MouseEvent(kind, { bubbles: true, cancelable: true }));
    }
  });
})();
