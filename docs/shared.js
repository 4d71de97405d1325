/* Shared robots and runs in the pages have the light or dark theme of the pages. */
"use strict";

(() => {
  const tell = (frame) => frame.contentWindow?.postMessage(
    { theme: document.body.dataset.mdColorScheme === "slate" ? "dark" : "light" }, "*");
  const frames = () => document.querySelectorAll("iframe.shared");
  window.addEventListener("message", ({ source, data }) => {
    for (const frame of frames()) if (data?.theme === "asked" && frame.contentWindow === source) tell(frame);
  });
  frames().forEach(tell); // frames that sent their request before this script was loaded
  new MutationObserver(() => frames().forEach(tell)).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });
})();
