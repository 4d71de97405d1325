/* Shared robots and runs within the pages are light or dark as these are. */
"use strict";

(() => {
  const tell = (frame) => frame.contentWindow?.postMessage(
    { theme: document.body.dataset.mdColorScheme === "slate" ? "dark" : "light" }, "*");
  const frames = () => document.querySelectorAll("iframe.shared");
  window.addEventListener("message", ({ source, data }) => {
    for (const frame of frames()) if (data?.theme === "asked" && frame.contentWindow === source) tell(frame);
  });
  frames().forEach(tell); // those that asked before anybody listened
  new MutationObserver(() => frames().forEach(tell)).observe(document.body, { attributeFilter: ["data-md-color-scheme"] });
})();
