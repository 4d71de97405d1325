// This script runs before viser's client.
(() => {
  const ask = window.matchMedia.bind(window);

  // Theme of the system: first through the client's own switch, later through the attribute that its styles use.
  const dark = ask("(prefers-color-scheme: dark)");
  window.__VISER_EMBED_CONFIG__ = { darkMode: dark.matches };
  dark.addEventListener("change", () => {
    document.documentElement.dataset.mantineColorScheme = dark.matches ? "dark" : "light";
  });

  // Two panels of 680 px leave no space for a robot on a tablet, which therefore gets the bottom sheet, like a phone.
  window.matchMedia = (query) => ask(query === "(max-width: 36em)" ? "(max-width: 60em)" : query);
})();
