/* Light or dark: as the system, or as the page around says, which is asked. */
"use strict";

const theme = (() => {
  const system = matchMedia("(prefers-color-scheme: dark)"), heard = [];
  let asked = null;

  function set() {
    document.documentElement.dataset.theme = asked ?? (system.matches ? "dark" : "light");
    for (const tell of heard) tell();
  }

  system.addEventListener("change", set);
  window.addEventListener("message", ({ source, data }) => {
    if (source !== window.parent || !["light", "dark"].includes(data?.theme)) return;
    asked = data.theme;
    set();
  });
  if (window.parent !== window) window.parent.postMessage({ theme: "asked" }, "*");
  set();
  return { follow: (tell) => heard.push(tell) };
})();
