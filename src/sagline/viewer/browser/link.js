// A link brings its state behind the number sign: sent to the server once, then taken off the address.
(() => {
  const USUAL = "Readings"; // the tab that is open where a link names none
  const open = () =>
    [...document.querySelectorAll('[role=tab][aria-selected="true"]')]
      .map((tab) => tab.textContent.trim())
      .filter((name) => name && name !== USUAL);

  window.sagline.linked = (text) => {
    const tabs = open().map((name) => `&tab=${encodeURIComponent(name)}`);
    return `${location.origin}${location.pathname}#${text}${tabs.join("")}`;
  };

  let wanted = []; // tabs, which may not be there yet
  const show = () => {
    wanted = wanted.filter((name) => {
      const tab = [...document.querySelectorAll("[role=tab]")].find((each) => each.textContent.trim() === name);
      if (!tab) return true;
      for (const kind of ["pointerdown", "mousedown", "pointerup", "mouseup", "click"]) {
        tab.dispatchEvent(new (kind.startsWith("pointer") ? PointerEvent : MouseEvent)(kind, { bubbles: true, button: 0 }));
      }
      return false;
    });
  };
  const take = () => {
    const hash = location.hash.slice(1);
    if (!hash.includes("=")) return;
    history.replaceState(null, "", location.pathname + location.search); // a reload is no second visit
    const parts = hash.split("&");
    const tabs = parts.filter((part) => part.startsWith("tab=")).map((part) => part.slice(4));
    window.sagline.ask("link", parts.filter((part) => !part.startsWith("tab=")).join("&"), ({ refused }) => {
      window.sagline.refuse(refused ?? "");
      if (refused) return;
      wanted = tabs.slice(0, 5).map((name) => {
        try {
          return decodeURIComponent(name);
        } catch {
          return ""; // nonsense
        }
      });
      show();
    });
  };
  window.sagline.dress(() => {
    if (wanted.length) show();
  });
  window.addEventListener("hashchange", take);
  take();
})();
