// Runs before viser's client does.
(() => {
  const ask = window.matchMedia.bind(window);

  // The system's theme: on the first paint through the client's own switch, later through what its styles hang on.
  const dark = ask("(prefers-color-scheme: dark)");
  window.__VISER_EMBED_CONFIG__ = { darkMode: dark.matches };
  dark.addEventListener("change", () => {
    document.documentElement.dataset.mantineColorScheme = dark.matches ? "dark" : "light";
  });

  // Two panels of 680 px leave no room for a robot on a tablet: the bottom sheet already there, not only on phones.
  window.matchMedia = (query) => ask(query === "(max-width: 36em)" ? "(max-width: 60em)" : query);

  // The client speaks to its server through a worker, which tells when the connection opens and closes.
  const say = (lost) => {
    let banner = document.getElementById("sagline-lost");
    if (!banner && lost) {
      banner = document.createElement("div");
      banner.id = "sagline-lost";
      banner.setAttribute("role", "alert");
      banner.textContent = "Disconnected: is sagline view still running? The page comes back when it does.";
      document.body.append(banner);
    }
    if (banner) banner.hidden = !lost;
  };
  let waiting = 0;
  window.Worker = class extends window.Worker {
    constructor(...parts) {
      super(...parts);
      this.addEventListener("message", ({ data }) => {
        if (data?.type === "connected") {
          clearTimeout(waiting);
          waiting = 0;
          say(false);
        } else if (data?.type === "closed" && !waiting) {
          waiting = setTimeout(() => say(true), 1500); // a reload or a short break needs no words
        }
      });
    }
  };

  // A mode that is clicked, in the list or in the figure, is written into the field that says which one moves.
  document.addEventListener("click", (event) => {
    const mode = event.target.closest?.("[data-mode]")?.dataset.mode;
    if (mode === undefined) return;
    const label = [...document.querySelectorAll("label")].find((each) => each.textContent.trim() === "Mode");
    const after = (each) => label.compareDocumentPosition(each) & Node.DOCUMENT_POSITION_FOLLOWING;
    const field = label && [...document.querySelectorAll("input")].find(after);
    if (!field) return;
    const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
    set.call(field, field.value === mode ? "" : mode); // the client's framework keeps a value of its own
    field.dispatchEvent(new Event("input", { bubbles: true }));
  });
})();
