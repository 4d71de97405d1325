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
})();
