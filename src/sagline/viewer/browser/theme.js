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
})();
